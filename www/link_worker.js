// The decoding worker: a second instance of the viewer's module, which owns the socket (see viewer/src/link).
import init, { link_worker_start, speak } from "./semascan_viewer.js";

self.onmessage = async ({ data }) => {
  self.onmessage = null;
  try {
    await init({ module_or_path: data.module });
    if (data.messages) speak(data.language, data.messages);
    link_worker_start(data.url);
  } catch (error) {
    // Thrown outside the promise, so that the page's worker.onerror hears it.
    setTimeout(() => { throw error; });
  }
};
