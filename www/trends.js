// What the inspections that are searched for come to (`GET api/v1/trends`): bars of the verdicts day by day, and what was found on
// which component. `inspections.js` says for which search.
import { figure, t } from "./messages.js";

const SVG = "http://www.w3.org/2000/svg";
const KINDS = ["accept", "person", "rework", "reject", "none"];
const NAMES = {
  accept: () => t("trends.accept"),
  person: () => t("trends.person"),
  rework: () => t("trends.rework"),
  reject: () => t("trends.reject"),
  none: () => t("inspections.not_judged"),
};
// Days that are drawn, the latest ones; more would be thinner than a line.
const MOST_DAYS = 60;
const HEIGHT = 120;
const SLOT = 14;
const ONE_DECIMAL = { maximumFractionDigits: 1 };
const THREE_DIGITS = { minimumSignificantDigits: 3, maximumSignificantDigits: 3 };

const element = (id) => document.getElementById(id);
const [panel, said, days, confidence, classes] = ["trends", "trends-said", "days", "confidence", "classes"].map(element);
let latest = 0;
let query = new URLSearchParams();

/** Takes another search; it is asked for while the panel is open. */
export const follow = (parameters) => {
  query = new URLSearchParams(parameters);
  for (const name of ["cursor", "limit"]) query.delete(name);
  said.textContent = "";
  if (panel.open) show();
};

const show = async () => {
  const number = ++latest;
  said.textContent = t("inspections.loading");
  let answer, body;
  try {
    answer = await fetch(`api/v1/trends?${query}`, { cache: "no-cache" });
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
  const judged = sum(body.days, judgedOn);
  const accepted = sum(body.days, (day) => day.accept);
  const share = judged > 0 ? t("trends.share", { percent: Math.round((100 * accepted) / judged), judged }) : t("trends.none_judged");
  said.textContent = t("trends.said", { count: body.inspections, share });
  days.replaceChildren(...(body.days.length > 0 ? [bars(body.days.slice(-MOST_DAYS))] : []));
  confidence.hidden = body.days.every((day) => day.confidence === undefined);
  if (!confidence.hidden) confidence.lastElementChild.replaceChildren(line(body.days.slice(-MOST_DAYS)));
  const looked = sum(body.days, (day) => day.looked);
  classes.replaceChildren(...body.classes.map((found) => row(found, looked)));
};

const sum = (list, of) => list.reduce((all, one) => all + of(one), 0);

/** A bar for each day on which there was an inspection. */
const bars = (list) => {
  const most = Math.max(...list.map((day) => day.inspections));
  const chart = made("svg", {
    viewBox: `0 0 ${SLOT * list.length} ${HEIGHT}`,
    width: SLOT * list.length,
    height: HEIGHT,
    role: "img",
    "aria-label": list.map(inWords).join("; "),
  });
  list.forEach((day, place) => {
    const counts = byKind(day);
    const bar = made("g", {});
    bar.append(Object.assign(made("title", {}), { textContent: inWords(day) }));
    let top = HEIGHT;
    for (const kind of KINDS) {
      const height = (counts[kind] / most) * (HEIGHT - 4);
      if (height === 0) continue;
      top -= height;
      bar.append(made("rect", { x: SLOT * place + 2, y: top, width: SLOT - 4, height, "data-kind": kind }));
    }
    chart.append(bar);
  });
  return chart;
};

/** A point for each day whose inspections say how sure their labels are, from the least of all to 1; days that say nothing break the line. */
const line = (list) => {
  const known = list.filter((day) => day.confidence !== undefined);
  const least = Math.min(0.99, Math.floor(20 * Math.min(...known.map((day) => day.confidence))) / 20);
  const height = (share) => HEIGHT - 4 - ((share - least) / (1 - least)) * (HEIGHT - 8);
  const chart = made("svg", {
    viewBox: `0 0 ${SLOT * list.length} ${HEIGHT}`,
    width: SLOT * list.length,
    height: HEIGHT,
    role: "img",
    "aria-label": known.map(sureness).join("; "),
  });
  let before;
  list.forEach((day, place) => {
    const at = day.confidence === undefined ? undefined : { x: SLOT * (place + 0.5), y: height(day.confidence) };
    if (at && before) chart.append(made("line", { x1: before.x, y1: before.y, x2: at.x, y2: at.y }));
    if (at) {
      const point = made("circle", { cx: at.x, cy: at.y, r: 4 });
      point.append(Object.assign(made("title", {}), { textContent: sureness(day) }));
      chart.append(point);
    }
    before = at;
  });
  const scale = document.createElement("div");
  scale.className = "trends-scale";
  scale.setAttribute("aria-hidden", "true");
  scale.replaceChildren(...[1, least].map((share) => Object.assign(document.createElement("span"), { textContent: percent(share) })));
  const plot = document.createElement("div");
  plot.className = "trends-plot";
  plot.append(scale, chart);
  return plot;
};

const percent = (share) => `${figure(100 * share, ONE_DECIMAL)} %`;

const sureness = (day) => `${day.day}: ${percent(day.confidence)}`;

const judgedOn = (day) => day.accept + day.person + day.rework + day.reject;

const byKind = (day) => ({ ...day, none: day.inspections - judgedOn(day) });

const inWords = (day) => {
  const counts = byKind(day);
  const parts = KINDS.filter((kind) => counts[kind] > 0).map((kind) => `${counts[kind]} ${NAMES[kind]()}`);
  return `${day.day}: ${parts.join(", ")}`;
};

const made = (name, attributes) => {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};

/** Findings of a kind. All text comes from the agent and stays text. */
const row = (found, looked) => {
  const line = document.createElement("tr");
  const head = document.createElement("th");
  head.scope = "row";
  head.textContent = t("review.finding", { kind: found.defect ?? what(found.kind), component: found.component });
  line.append(head);
  const share = line.insertCell();
  const meter = document.createElement("meter");
  // Of those in which somebody looked: the others are no sign that there is nothing.
  Object.assign(meter, { min: 0, max: Math.max(looked, found.inspections), value: found.inspections });
  meter.setAttribute("aria-hidden", "true");
  share.append(meter, ` ${t("trends.of", { count: found.inspections, all: Math.max(looked, found.inspections) })}`);
  const count = line.insertCell();
  count.textContent = found.findings;
  count.className = "is-number";
  const area = line.insertCell();
  const measured = found.findings - found.without_area;
  area.textContent = measured > 0 && found.area !== undefined ? `${figure((1e6 * found.area) / measured, THREE_DIGITS)} mm²` : t("common.not_known");
  area.className = "is-number";
  return line;
};

const what = (kind) => 
  ({ completeness: t("review.not_wholly_seen"), deviation: t("review.off_reference"), drawn: t("review.remark.within") })[kind] ?? kind;

panel.addEventListener("toggle", () => panel.open && show());
