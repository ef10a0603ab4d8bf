// Two kept inspections from the same place (`?first=ID&second=ID&mode=beside`). The panes tell this page what they show, and it tells
// the others (viewer/src/shell/pane.rs).
import { speak, t, time } from "./messages.js";

const element = (id) => document.getElementById(id);
const [form, edge, divider, said] = ["mode", "edge", "divider", "said"].map(element);
const main = document.querySelector("main");
const whole = document.querySelector(".compare-difference");
const ID = /^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/;
const MODES = ["beside", "swipe", "difference"];
const DECISIONS = {
  accept: () => t("decision.accept"),
  rework: () => t("decision.rework"),
  reject: () => t("decision.reject"),
  person: () => t("decision.person"),
};

const parameters = new URLSearchParams(location.search);
const ids = ["first", "second"].map((name) => parameters.get(name) ?? "");
const panes = [0, 1].map((place) => element(`pane-${place}`));
let mode = MODES.includes(parameters.get("mode")) ? parameters.get("mode") : "beside";
// What the first pane shows, for a second one that is there later.
let shown = null;

/** What the panes pass on of this page's address: which graphics, theme and language they use. */
const passed = (more) => {
  const given = new URLSearchParams(more);
  for (const name of ["renderer", "theme", "language"]) {
    if (parameters.has(name)) given.set(name, parameters.get(name));
  }
  return given;
};

const show = () => {
  main.dataset.mode = mode;
  form.elements.mode.value = mode;
  element("edge-row").hidden = mode !== "swipe";
  divider.hidden = mode !== "swipe";
  whole.hidden = mode !== "difference";
  // The frame of the difference is a third model: it is there once somebody asks for it.
  if (mode === "difference" && !whole.firstChild) {
    const frame = document.createElement("iframe");
    frame.title = t("compare.difference.title");
    frame.src = `./?${passed({ inspection: ids[0], reference: ids[1], speed: "1000" })}`;
    whole.append(frame);
  }
  swipe();
};

const swipe = () => main.style.setProperty("--edge", `${edge.value}%`);

const name = async (place) => {
  const title = element(`name-${place}`);
  try {
    const answer = await fetch(`api/v1/inspections/${ids[place]}`, { cache: "no-cache" });
    if (answer.status === 401) {
      location.replace(`login.html?next=${encodeURIComponent(location.pathname + location.search)}`);
      return;
    }
    const item = await answer.json();
    if (!answer.ok) throw new Error(item.detail ?? t("link.answered", { status: answer.status }));
    const parts = [item.part || t("inspections.unnamed"), time(new Date(item.began))];
    if (item.decision) parts.push(DECISIONS[item.decision]());
    title.textContent = parts.join(" · ");
    panes[place].src = `./?${passed({ inspection: ids[place], speed: "1000", pane: "" })}`;
  } catch (error) {
    title.textContent = ids[place];
    said.textContent = error instanceof TypeError ? t("compare.away") : error.message;
  }
};

addEventListener("message", (event) => {
  const from = panes.findIndex((pane) => pane.contentWindow === event.source);
  if (event.origin !== location.origin || from < 0 || typeof event.data?.view !== "string") return;
  const { view, steered } = event.data;
  const tell = (place, view) => panes[place].contentWindow?.postMessage({ view }, location.origin);
  // Until somebody moves a camera, the first pane leads.
  if (steered || from === 0) {
    shown = view;
    tell(1 - from, view);
  } else if (shown) {
    tell(from, shown);
  }
});

form.addEventListener("change", () => {
  mode = form.elements.mode.value;
  parameters.set("mode", mode);
  history.replaceState(null, "", `?${parameters}`);
  show();
});
form.addEventListener("submit", (event) => event.preventDefault());
edge.addEventListener("input", swipe);
element("exchange").addEventListener("click", () => {
  location.search = new URLSearchParams({ ...Object.fromEntries(parameters), first: ids[1], second: ids[0] });
});
divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
divider.addEventListener("pointermove", (event) => {
  if (!divider.hasPointerCapture(event.pointerId)) return;
  const { left, width } = main.getBoundingClientRect();
  edge.value = String((100 * (event.clientX - left)) / width);
  swipe();
});

await speak();
if (ids.every((id) => ID.test(id))) {
  show();
  [0, 1].forEach(name);
} else {
  said.textContent = t("compare.no_two");
}
