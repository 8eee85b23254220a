"use strict";
// A study whose pages stand elsewhere: answers are kept on this device, and all of them are sent to one address after
// each page. docs/study.md describes the message.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const kept = `greensward-study ${data.plan}`;
  const parts = [...document.querySelectorAll("[data-part]")];
  const stages = [...document.querySelectorAll("form.stage")];
  const progress = document.querySelector(".progress");
  const mine = document.querySelector(".mine");
  let order = {};
  let at = 0;
  let shownAt = 0;

  const state = () => JSON.parse(localStorage.getItem(kept));
  const keep = (changed) => localStorage.setItem(kept, JSON.stringify(changed));

  // The same staircase as in the report: Levitt 1971
  function trialsOf(name, { levels, reference, down, reversals, most }, answers) {
    const trials = [];
    let [level, way, right, turns] = [levels.length - 1, 0, 0, 0];
    while (turns < reversals && trials.length < most) {
      const side = order[name][trials.length];
      const key = `${name}.${trials.length}`;
      trials.push({ key, shown: side ? [reference, levels[level]] : [levels[level], reference] });
      if (!(key in answers)) break;
      const correct = answers[key].values[0] === String(side);
      right = correct ? right + 1 : 0;
      if (correct && right < down) continue;
      right = 0;
      const now = correct ? -1 : 1;
      if (way && now !== way) turns++;
      way = now;
      level = Math.min(Math.max(level + way, 0), levels.length - 1);
    }
    return trials;
  }

  const keysOf = (stage) => [...stage.querySelectorAll("[data-key]")].map((each) => each.dataset.key);

  function pagesOf(answers) {
    return stages.flatMap((stage, number) => {
      const name = keysOf(stage)[0].split(".")[0];
      if (stage.dataset.kind === "plain") return [{ stage, number, keys: keysOf(stage) }];
      const trials = data.stairs[name]
        ? trialsOf(name, data.stairs[name], answers)
        : order[name].map((shown, k) => ({ key: `${name}.${k}`, shown }));
      return trials.map(({ key, shown }) => ({ stage, number, keys: [key], shown }));
    });
  }

  const isAnswered = (page, answers) => page.keys.every((key) => key in answers);

  function showPart(part) {
    for (const each of parts) each.hidden = each !== part;
    scrollTo(0, 0);
    part.querySelector("h1").focus({ preventScroll: true });
  }

  const partOf = (name) => parts.find((part) => part.dataset.part === name);

  function picture({ file, clip, alt, letter }) {
    const made = document.createElement(clip ? "video" : "img");
    const label = alt ? `${letter}: ${alt}` : letter;
    [made.width, made.height] = data.size;
    if (clip) {
      Object.assign(made, { muted: true, loop: true, playsInline: true, controls: true });
      made.setAttribute("aria-label", label);
    } else made.alt = label;
    made.src = file;
    return made;
  }

  function show(wanted) {
    const current = state();
    if (!current) return showPart(partOf("start"));
    const pages = pagesOf(current.answers);
    const open = pages.findIndex((page) => !isAnswered(page, current.answers));
    at = Math.max(Math.min(wanted, open < 0 ? pages.length : open), 0);
    mine.hidden = false;
    progress.hidden = at >= pages.length;
    if (at >= pages.length) {
      document.querySelector("p.code").textContent = current.code;
      showPart(partOf("end"));
      return tell();
    }
    const page = pages[at];
    const { stage, keys } = page;
    const known = Object.keys(data.stairs).length ? [page.number + 1, stages.length] : [at + 1, pages.length];
    const words = data.words.progress.replace("{page}", known[0]).replace("{pages}", known[1]);
    progress.querySelector("span").textContent = words;
    Object.assign(progress.querySelector("progress"), { max: known[1], value: known[0] - 1, ariaLabel: words });
    stage.querySelector("h1").textContent = words;
    stage.querySelector(".errors").hidden = true;
    stage.querySelector("button[value=back]").hidden = at === 0;
    if (page.shown) {
      for (const input of stage.querySelectorAll("input")) input.name = `a.${keys[0]}`;
      stage.querySelectorAll(".frame").forEach((frame, side) =>
        frame.replaceChildren(picture({ ...data.pictures[page.shown[side]], letter: "AB"[side] })),
      );
    }
    fill(page, current.answers);
    showPart(stage);
    tellSmall(stage);
    play(stage);
    shownAt = performance.now();
    // pictures of the next page, and in a staircase those of either answer
    const soon = data.stairs[keys[0].split(".")[0]];
    for (const name of [...(pages[at + 1]?.shown ?? []), ...(soon ? soon.levels : [])])
      if (!data.pictures[name].clip) new Image().src = data.pictures[name].file;
  }

  const inputsOf = (stage, key) => [...stage.elements].filter((each) => each.name === `a.${key}`);
  const ownOf = (stage, key) => stage.elements.namedItem(`o.${key}`);

  function fill({ stage, keys }, answers) {
    for (const key of keys) {
      const { values = [], other = "" } = answers[key] ?? {};
      for (const input of inputsOf(stage, key))
        if (/radio|checkbox/.test(input.type)) input.checked = values.includes(input.value);
        else input.value = values[0] ?? "";
      if (ownOf(stage, key)) ownOf(stage, key).value = other;
    }
  }

  function filled(stage, key) {
    const inputs = inputsOf(stage, key);
    const chosen = inputs.filter((each) => (/radio|checkbox/.test(each.type) ? each.checked : each.value.trim()));
    return { values: chosen.map((each) => each.value), other: ownOf(stage, key)?.value.trim() ?? "" };
  }

  function problemOf(stage, key, { values, other }) {
    const [input] = inputsOf(stage, key);
    if (!values.length && !other) return data.required.includes(key.split(".")[0]) ? "required" : "";
    const { least, most } = input.dataset;
    const number = Number(values[0]);
    return least !== undefined && !(/^[+-]?\d+$/.test(values[0].trim()) && number >= least && number <= most) ? "not_offered" : "";
  }

  function take(page) {
    const { stage, keys } = page;
    const given = keys.map((key) => [key, filled(stage, key)]);
    const problems = given.map(([key, answer]) => [key, problemOf(stage, key, answer)]).filter(([, word]) => word);
    const errors = stage.querySelector(".errors");
    errors.hidden = !problems.length;
    if (problems.length) {
      const told = problems.map(([key, word]) => {
        const [link, item] = [document.createElement("a"), document.createElement("li")];
        const name = key.split(".")[0];
        const asked = document.getElementById(`q-${name}`);
        link.href = `#q-${name}`;
        link.textContent = (asked.matches("legend") ? asked : stage.querySelector(`label[for="q-${name}"]`)).textContent;
        link.addEventListener("click", (event) => {
          event.preventDefault();
          asked.focus();
        });
        item.append(link, ` ${data.words[word]}.`);
        return item;
      });
      errors.querySelector("ul").replaceChildren(...told);
      errors.focus();
      return false;
    }
    const current = state();
    const [seconds, instant] = [(performance.now() - shownAt) / 1000, new Date().toISOString()];
    for (const [key, answer] of given) {
      const before = current.answers[key];
      if (before && JSON.stringify([before.values, before.other]) === JSON.stringify([answer.values, answer.other])) continue;
      const [name, number] = key.split(".");
      // what followed from another answer of a staircase is asked again
      if (data.stairs[name])
        for (const later of Object.keys(current.answers))
          if (later.startsWith(`${name}.`) && Number(later.split(".")[1]) > number) delete current.answers[later];
      current.answers[key] = { ...answer, seconds: Math.min(seconds, 86400), at: instant };
    }
    current.arrived = false;
    keep(current);
    return true;
  }

  async function post(message) {
    const stop = new AbortController();
    const timer = setTimeout(() => stop.abort(), 30_000);
    try {
      // plain text asks no leave of other sites beforehand
      return await fetch(data.endpoint, { method: "POST", body: JSON.stringify(message), signal: stop.signal });
    } catch {
      return null;
    } finally {
      clearTimeout(timer);
    }
  }

  let [isSending, refusal] = [false, ""];

  async function send() {
    if (isSending) return;
    isSending = true;
    for (let current = state(); current && !current.arrived && Object.keys(current.answers).length; current = state()) {
      const { code, seed, begun, answers } = current;
      const sent = JSON.stringify(answers);
      const language = document.documentElement.lang;
      const reply = await post({ plan: data.plan, code, seed, language, begun, sent: new Date().toISOString(), answers });
      refusal = reply && !reply.ok && reply.status !== 429 && reply.status < 500 ? (await reply.text()).slice(0, 300) : "";
      if (!reply?.ok) break;
      const now = state();
      if (now && JSON.stringify(now.answers) === sent) keep({ ...now, arrived: true });
    }
    isSending = false;
    tell();
  }

  function tell() {
    const current = state();
    const words = refusal ? `${data.words.refused} ${refusal}` : current?.arrived ? data.words.arrived : data.words.not_arrived;
    document.querySelector(".arrival").textContent = words;
    for (const status of document.querySelectorAll("form.stage .sending")) status.textContent = refusal ? words : "";
  }

  function letters(count) {
    let made = "";
    const largest = 256 - (256 % data.letters.length);
    while (made.length < count)
      for (const byte of crypto.getRandomValues(new Uint8Array(32)))
        if (byte < largest && made.length < count) made += data.letters[byte % data.letters.length];
    return made;
  }

  async function begin() {
    if (!state()) {
      const [random] = crypto.getRandomValues(new Uint32Array(1));
      const code = letters(16).match(/.{4}/g).join("-");
      keep({ code, seed: 1 + (random % data.orders), begun: new Date().toISOString(), answers: {}, arrived: true });
    }
    await goOn(Infinity);
  }

  async function goOn(wanted) {
    if (!(await prepareOrder())) return;
    show(wanted);
    history.replaceState({ at }, "");
    send();
  }

  // False without a connection; what was answered before is still there.
  async function prepareOrder() {
    const reply = await fetch(`orders/${state().seed}.json`).catch(() => null);
    if (reply?.ok) order = await reply.json();
    partOf("start").querySelector(".sending").textContent = reply?.ok ? "" : data.words.no_connection;
    return reply?.ok;
  }

  function go(wanted) {
    show(wanted);
    history.pushState({ at }, "");
  }

  document.querySelector("form.begin").addEventListener("submit", (event) => {
    event.preventDefault();
    begin();
  });
  for (const stage of stages) {
    prepare(stage);
    stage.addEventListener("submit", (event) => {
      event.preventDefault();
      // the second of two clicks is not for the next page
      if (performance.now() - shownAt < 250) return;
      const page = pagesOf(state()?.answers ?? {})[at];
      if (page?.stage !== stage || !take(page)) return;
      go(at + 1);
      send();
    });
  }
  for (const back of document.querySelectorAll("button[value=back]")) back.addEventListener("click", () => go(at - (partOf("delete").hidden ? 1 : 0)));
  mine.querySelector("button").addEventListener("click", () => {
    mine.hidden = true;
    showPart(partOf("delete"));
  });
  document.querySelector("button[value=delete]").addEventListener("click", async () => {
    const status = partOf("delete").querySelector(".sending");
    status.textContent = data.words.sending;
    const reply = await post({ plan: data.plan, delete: true, code: state().code });
    status.textContent = reply?.ok ? "" : data.words.not_deleted;
    if (!reply?.ok) return;
    localStorage.removeItem(kept);
    progress.hidden = true;
    showPart(partOf("deleted"));
  });
  addEventListener("popstate", (event) => event.state && show(event.state.at));
  addEventListener("online", send);
  // another tab has gone on
  addEventListener("storage", (event) => event.key === kept && show(at));
  setInterval(send, 15_000);

  if (data.closes && new Date().toISOString().slice(0, 10) > data.closes) {
    document.querySelector(".closed").hidden = false;
    document.querySelector("form.begin").hidden = true;
  } else if (state()) goOn(history.state?.at ?? Infinity);
})();
