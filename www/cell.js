// This cell as it is now (`healthz`, `readyz`): what it does, how far it is, and why it cannot. Asked for while the page is seen.
import { figure, speak, t } from "./messages.js";

const EVERY_MS = 3000;
const STATES = {
  waiting: () => t("cell.waiting"),
  running: () => t("cell.running"),
  stalled: () => t("cell.stalled"),
  finished: () => t("cell.finished"),
  failed: () => t("cell.failed"),
  away: () => t("cell.away"),
};

const element = (id) => document.getElementById(id);
const ready = speak();
// What was seen last: another inspection or state is news for the list.
let seen = null;

const ask = async (path) => {
  // Who is not well answers 503, and says why.
  const answer = await fetch(path, { cache: "no-store" });
  return answer.json();
};

const look = async () => {
  await ready;
  let health, readiness;
  try {
    [health, readiness] = await Promise.all(["healthz", "readyz"].map(ask));
  } catch {
    health = { state: "away" };
    readiness = { ready: true };
  }
  show(health, readiness);
  const now = `${health.inspection ?? ""} ${health.state}`;
  if (seen !== null && seen !== now) dispatchEvent(new Event("semascan-cell-changed"));
  seen = now;
};

const show = (health, readiness) => {
  const { state, views_done: done, views_expected: expected, views_rejected: rejected, viewers } = health;
  const badge = element("cell-state");
  badge.textContent = (STATES[state] ?? (() => state))();
  badge.dataset.kind = { running: "running", finished: "accept", stalled: "interrupted", failed: "failed", away: "interrupted" }[state] ?? "";
  const said = [];
  const runs = state === "running" || state === "stalled";
  if (done > 0 || runs) said.push(expected > 0 ? t("cell.views_of", { done, expected }) : t("cell.views", { count: done ?? 0 }));
  if (rejected > 0) said.push(t("cell.rejected", { count: rejected }));
  if (state === "stalled") said.push(t("cell.still", { seconds: figure(health.seconds_since_progress, 0) }));
  if (viewers > 0) said.push(t("cell.viewers", { count: viewers }));
  if (health.message) said.push(health.message);
  if (!readiness.ready) said.push(t("cell.not_ready", { reason: readiness.reason ?? "" }));
  element("cell-said").textContent = said.join(" · ");
  const views = element("cell-views");
  views.hidden = !(runs && expected > 0);
  views.max = expected > 0 ? expected : 1;
  views.value = done ?? 0;
  element("cell-watch").hidden = state === "away" || !health.inspection;
};

const lookOn = async () => {
  if (!document.hidden) await look();
  setTimeout(lookOn, EVERY_MS);
};
document.addEventListener("visibilitychange", () => document.hidden || look());
lookOn();
