// The decoding worker: a second instance of the viewer's module, which owns the socket or plays a file (see viewer/src/link).
import init, { link_worker_start, player_worker_start, speak } from "./semascan_viewer.js";

self.onmessage = async ({ data }) => {
  // What the page asks for meanwhile is asked again as soon as there is somebody to hear it.
  const early = [];
  self.onmessage = (message) => early.push(message);
  try {
    await init({ module_or_path: data.module });
    if (data.messages) speak(data.language, data.messages);
    if (data.file) {
      player_worker_start(new Uint8Array(data.file), data.memory);
    } else {
      link_worker_start(data.url, data.memory);
    }
    early.forEach((message) => self.onmessage(message));
  } catch (error) {
    // Thrown outside the promise, so that the page's worker.onerror hears it.
    setTimeout(() => { throw error; });
  }
};
