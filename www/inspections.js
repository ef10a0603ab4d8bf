// The list of inspections that an agent keeps (`GET api/v1/inspections`). What is looked for stands in the page's address, so that
// it can be sent to somebody and survives a reload.
import { figure, offerLanguages, speak, t, time } from "./messages.js";
import { follow } from "./trends.js";

const ready = speak();

const element = (id) => document.getElementById(id);
const [filter, rows, said, more] = ["filter", "rows", "said", "more"].map(element);
const DECISIONS = {
  accept: () => t("decision.accept"),
  rework: () => t("decision.rework"),
  reject: () => t("decision.reject"),
  person: () => t("decision.person"),
};
const STATES = {
  finished: () => t("inspections.state.finished"),
  running: () => t("inspections.state.running"),
  stopped: () => t("inspections.state.stopped"),
  failed: () => t("inspections.state.failed"),
  interrupted: () => t("inspections.state.interrupted"),
};
// Inspections of a page.
const PAGE = 50;
const DAY_MS = 86_400_000;

// Counts requests: an answer to an earlier one comes too late.
let latest = 0;
let next = null;

/** What the form asks for, as parameters of this page. */
const asked = () => {
  const parameters = new URLSearchParams();
  for (const [name, value] of new FormData(filter)) {
    if (String(value).trim()) parameters.set(name, String(value).trim());
  }
  return parameters;
};

/** The same as parameters of the API: days are those of this browser's time zone. */
const query = (cursor) => {
  const parameters = asked();
  const day = (name, days) => {
    const text = parameters.get(name);
    if (!text) return;
    const [year, month, date] = text.split("-").map(Number);
    parameters.set(name, new Date(year, month - 1, date + days).toISOString());
  };
  day("from", 0);
  day("until", 1);
  if (cursor) parameters.set("cursor", cursor);
  return parameters;
};

const show = async (cursor) => {
  const number = ++latest;
  await ready;
  if (number !== latest) return;
  if (!cursor) {
    rows.replaceChildren();
    follow(query(null));
  }
  more.hidden = true;
  said.textContent = t("inspections.loading");
  let answer, body;
  try {
    answer = await fetch(`api/v1/inspections?${query(cursor)}`, { cache: "no-cache" });
    if (answer.status === 401) {
      location.replace(`login.html?next=${encodeURIComponent(location.pathname + location.search)}`);
      return;
    }
    body = await answer.json();
  } catch {
    if (number === latest) said.textContent = t("link.unreachable");
    return;
  }
  if (number !== latest) return;
  if (!answer.ok) {
    said.textContent = body.detail ?? t("link.agent_answered", { status: answer.status });
    return;
  }
  rows.append(...body.items.map(row));
  next = body.next ?? null;
  more.hidden = next === null;
  said.textContent = rows.children.length > 0 ? "" : asked().size > 0 ? t("inspections.none_fits") : t("inspections.none");
};

/** One inspection. All text comes from the agent and stays text. */
const row = (item) => {
  const line = document.createElement("tr");
  line.dataset.inspection = item.id;
  const cell = (text, className = "") => {
    const made = line.insertCell();
    made.textContent = text;
    made.className = className;
    return made;
  };
  const name = cell("");
  name.append(link(item.part || t("inspections.unnamed"), `./?inspection=${encodeURIComponent(item.id)}`, item.source));
  if (item.held) name.append(" ", badge(t("inspections.held"), "", t("inspections.held.title")));
  cell(time(new Date(item.began)));
  cell(item.ended ? took(new Date(item.ended) - new Date(item.began)) : "–");
  const state = cell("");
  state.append(badge(STATES[item.state]?.() ?? item.state, item.state === "finished" ? "" : item.state, item.reason));
  cell(item.views, "is-number");
  // Nobody having looked is no sign that there is nothing.
  cell(item.findings ?? t("inspect.not_looked_for"), "is-number");
  const verdict = cell("");
  verdict.append(item.decision ? badge(DECISIONS[item.decision](), item.decision) : t("inspections.not_judged"));
  if (item.automatic && item.automatic !== item.decision) verdict.append(` ${t("inspections.criteria", { decision: DECISIONS[item.automatic]() })}`);
  if (item.conflicts > 0) verdict.append(" ", badge(t("inspections.conflict.badge"), "interrupted"));
  const report = cell("", "is-number");
  if (item.ended) report.append(link(t("inspections.report"), `api/v1/inspections/${encodeURIComponent(item.id)}/report`, t("inspections.report.title", { part: item.part })));
  const compare = cell("", "is-number");
  if (item.ended) compare.append(choice(item));
  return line;
};

// Inspections that are to be compared, the first chosen first: their identifiers and parts.
const chosen = new Map();

/** Chooses an inspection for a comparison of two. */
const choice = (item) => {
  const box = document.createElement("input");
  const part = item.part || t("inspections.unnamed");
  Object.assign(box, { type: "checkbox", checked: chosen.has(item.id) });
  box.setAttribute("aria-label", t("compare.choose", { part, time: time(new Date(item.began)) }));
  box.addEventListener("change", () => {
    if (box.checked) chosen.set(item.id, part);
    else chosen.delete(item.id);
    showChosen();
  });
  return box;
};

const showChosen = () => {
  const [ids, parts] = [[...chosen.keys()], [...chosen.values()]];
  element("comparison").hidden = ids.length === 0;
  element("compare").hidden = ids.length !== 2;
  const said = { 1: () => t("compare.another", { part: parts[0] }), 2: () => t("compare.two", { first: parts[0], second: parts[1] }) };
  element("compared").textContent = (said[ids.length] ?? (() => t("compare.many", { number: ids.length })))();
  if (ids.length === 2) element("compare").href = `compare.html?first=${ids[0]}&second=${ids[1]}`;
};

const link = (text, href, title) => {
  const made = document.createElement("a");
  Object.assign(made, { textContent: text, href, title: title ?? "" });
  return made;
};

const badge = (text, kind, title) => {
  const made = document.createElement("span");
  Object.assign(made, { className: "inspections-badge", textContent: text, title: title ?? "" });
  made.dataset.kind = kind;
  return made;
};

const took = (milliseconds) => {
  const seconds = milliseconds / 1000;
  if (seconds < 100) return `${figure(seconds, 1)} s`;
  return milliseconds < DAY_MS / 12 ? `${figure(seconds / 60, 1)} min` : `${figure(seconds / 3600, 1)} h`;
};

/** The form as the page's address says it. */
const restore = () => {
  const parameters = new URLSearchParams(location.search);
  for (const field of filter.elements) {
    if (!field.name) continue;
    const value = parameters.get(field.name) ?? "";
    if (field.type === "checkbox") field.checked = value === field.value;
    else field.value = value;
  }
};

const search = () => {
  const parameters = asked();
  const language = new URLSearchParams(location.search).get("language");
  if (language) parameters.set("language", language);
  history.pushState(null, "", parameters.size > 0 ? `?${parameters}` : location.pathname);
  show(null);
};

filter.addEventListener("submit", (event) => {
  event.preventDefault();
  search();
});
// The fields are empty only after the event.
filter.addEventListener("reset", () => setTimeout(search));
more.addEventListener("click", () => show(next));
addEventListener("popstate", () => {
  restore();
  show(null);
});
// Another inspection began, or one ended; who has gone on to earlier ones is left there.
addEventListener("semascan-cell-changed", () => rows.children.length <= PAGE && show(null));
restore();
show(null);
offerLanguages(element("languages"));
