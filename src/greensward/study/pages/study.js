"use strict";
// The page works without this script. It measures time, loads the next pictures ahead, sends once, and knows keys.
const form = document.getElementById("form");
document.querySelector(".errors")?.focus();

if (form) {
  let shownAt = performance.now();
  let sent = false;

  addEventListener("pageshow", (event) => {
    if (!event.persisted) return;
    sent = false;
    shownAt = performance.now();
    document.getElementById("sending").textContent = "";
  });

  form.addEventListener("submit", (event) => {
    if (sent) {
      event.preventDefault();
      return;
    }
    sent = true;
    form.elements.seconds.value = ((performance.now() - shownAt) / 1000).toFixed(3);
    document.getElementById("sending").textContent = form.dataset.sending;
  });

  // a clip plays by itself only for those who do not mind motion; its controls are always there
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  for (const clip of document.querySelectorAll("video")) if (!still) clip.play().catch(() => {});

  const pair = form.querySelector(".pair");
  if (pair) {
    const sides = [...pair.querySelectorAll(".side")];
    sides.forEach((side) => side.querySelector("img")?.addEventListener("click", () => choose(side.querySelector("input"))));
    const answers = { ArrowLeft: "0", ArrowRight: "1", ArrowDown: "=" };
    addEventListener("keydown", (event) => {
      if (event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
      if (event.target.closest?.("video, a, textarea, input[type=text]")) return;
      const input = pair.querySelector(`input[value="${answers[event.key]}"]`);
      if (!input) return;
      event.preventDefault();
      choose(input);
    });
  }

  function choose(input) {
    input.checked = true;
    input.focus();
  }

  // a digit answers the score that has the focus
  for (const score of form.querySelectorAll(".score"))
    score.addEventListener("keydown", (event) => {
      const input = /^[0-9]$/.test(event.key) && score.querySelector(`input[value="${event.key}"]`);
      if (input) choose(input);
    });

  const small = document.getElementById("small");
  if (small) {
    const tell = () => (small.hidden = [...form.querySelectorAll(".frame")].every((each) => each.scrollWidth <= each.clientWidth));
    addEventListener("resize", tell);
    addEventListener("load", tell);
  }

  addEventListener("load", () => {
    for (const address of form.dataset.following.split(" ").filter(Boolean))
      fetch(address, { priority: "low" }).catch(() => {});
  });
}
