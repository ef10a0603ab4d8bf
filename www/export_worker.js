// The export worker: an instance of the viewer's module that writes the files of one export (viewer/src/export).
import init, { export_worker_start, speak } from "./semascan_viewer.js";

self.onmessage = async ({ data }) => {
  try {
    await init({ module_or_path: data.module });
    if (data.messages) speak(data.language, data.messages);
    export_worker_start(new Uint8Array(data.task));
  } catch (error) {
    // Thrown outside the promise, so that the page's worker.onerror hears it.
    setTimeout(() => { throw error; });
  }
};
