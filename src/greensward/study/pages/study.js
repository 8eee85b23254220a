"use strict";
// A page of questions works without this script. It measures time, loads the next pictures ahead, sends once, and knows keys.

function choose(input) {
  input.checked = true;
  input.focus();
}

// a clip plays by itself only for those who do not mind motion; its controls are always there
function play(form) {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  for (const clip of form.querySelectorAll("video")) clip.play().catch(() => {});
}

function tellSmall(form) {
  const small = form.querySelector(".too-small");
  if (small) small.hidden = [...form.querySelectorAll(".frame")].every((each) => each.scrollWidth <= each.clientWidth);
}

function prepare(form) {
  const pair = form.querySelector(".pair");
  if (pair) {
    pair.addEventListener("click", (event) => {
      if (event.target.matches("img")) choose(event.target.closest(".side").querySelector("input"));
    });
    const answers = { ArrowLeft: "0", ArrowRight: "1", ArrowDown: "=" };
    addEventListener("keydown", (event) => {
      if (form.hidden || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
      if (event.target.closest?.("video, a, textarea, input[type=text]")) return;
      const input = pair.querySelector(`input[value="${answers[event.key]}"]`);
      if (!input) return;
      event.preventDefault();
      choose(input);
    });
  }

  // a digit answers the score that has the focus
  for (const score of form.querySelectorAll(".score"))
    score.addEventListener("keydown", (event) => {
      const input = /^[0-9]$/.test(event.key) && score.querySelector(`input[value="${event.key}"]`);
      if (input) choose(input);
    });

  form.addEventListener("load", () => tellSmall(form), true);
  addEventListener("resize", () => tellSmall(form));
}

const form = document.getElementById("form");
document.querySelector("body > main .errors:not([hidden])")?.focus();

if (form) {
  let shownAt = performance.now();
  let sent = false;
  const status = form.querySelector(".sending");

  addEventListener("pageshow", (event) => {
    if (!event.persisted) return;
    sent = false;
    shownAt = performance.now();
    status.textContent = "";
  });

  form.addEventListener("submit", (event) => {
    if (sent) {
      event.preventDefault();
      return;
    }
    sent = true;
    form.elements.seconds.value = ((performance.now() - shownAt) / 1000).toFixed(3);
    status.textContent = form.dataset.sending;
  });

  prepare(form);
  play(form);
  addEventListener("load", () => {
    tellSmall(form);
    for (const address of form.dataset.following.split(" ").filter(Boolean))
      fetch(address, { priority: "low" }).catch(() => {});
  });
}
