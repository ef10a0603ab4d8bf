// What the inspections that are searched for come to (`GET api/v1/trends`): bars of the verdicts day by day, and what was found on
// which component. `inspections.js` says for which search.
globalThis.semascanTrends = (() => {
  "use strict";

  const SVG = "http://www.w3.org/2000/svg";
  const KINDS = ["accept", "person", "rework", "reject", "none"];
  const NAMES = { accept: "accepted", person: "for a person to decide", rework: "to be reworked", reject: "rejected", none: "not judged" };
  // Days that are drawn, the latest ones; more would be thinner than a line.
  const MOST_DAYS = 60;
  const HEIGHT = 120;
  const SLOT = 14;

  const element = (id) => document.getElementById(id);
  const [panel, said, days, classes] = ["trends", "trends-said", "days", "classes"].map(element);
  let latest = 0;
  let query = new URLSearchParams();

  /** Takes another search; it is asked for while the panel is open. */
  const follow = (parameters) => {
    query = new URLSearchParams(parameters);
    for (const name of ["cursor", "limit"]) query.delete(name);
    said.textContent = "";
    if (panel.open) show();
  };

  const show = async () => {
    const number = ++latest;
    said.textContent = "Loading …";
    let answer, body;
    try {
      answer = await fetch(`api/v1/trends?${query}`, { cache: "no-cache" });
      body = await answer.json();
    } catch {
      if (number === latest) said.textContent = "The agent cannot be reached.";
      return;
    }
    if (number !== latest) return;
    if (!answer.ok) {
      said.textContent = body.detail ?? `The agent answered ${answer.status}.`;
      return;
    }
    const judged = sum(body.days, judgedOn);
    const accepted = sum(body.days, (day) => day.accept);
    const share = judged > 0 ? `, ${Math.round((100 * accepted) / judged)} % of ${judged} judged ones accepted` : ", none judged";
    said.textContent = body.inspections === 1 ? `1 inspection${share}` : `${body.inspections} inspections${share}`;
    days.replaceChildren(...(body.days.length > 0 ? [bars(body.days.slice(-MOST_DAYS))] : []));
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

  const judgedOn = (day) => day.accept + day.person + day.rework + day.reject;

  const byKind = (day) => ({ ...day, none: day.inspections - judgedOn(day) });

  const inWords = (day) => {
    const counts = byKind(day);
    const parts = KINDS.filter((kind) => counts[kind] > 0).map((kind) => `${counts[kind]} ${NAMES[kind]}`);
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
    head.textContent = `${found.defect ?? what(found.kind)} on ${found.component}`;
    line.append(head);
    const share = line.insertCell();
    const meter = document.createElement("meter");
    // Of those in which somebody looked: the others are no sign that there is nothing.
    Object.assign(meter, { min: 0, max: Math.max(looked, found.inspections), value: found.inspections });
    meter.setAttribute("aria-hidden", "true");
    share.append(meter, ` ${found.inspections} of ${Math.max(looked, found.inspections)}`);
    const count = line.insertCell();
    count.textContent = found.findings;
    count.className = "is-number";
    const area = line.insertCell();
    const measured = found.findings - found.without_area;
    area.textContent = measured > 0 && found.area !== undefined ? `${((1e6 * found.area) / measured).toPrecision(3)} mm²` : "not known";
    area.className = "is-number";
    return line;
  };

  const what = (kind) => ({ completeness: "not wholly seen", deviation: "off the reference", drawn: "remark" })[kind] ?? kind;

  panel.addEventListener("toggle", () => panel.open && show());
  return { follow };
})();
