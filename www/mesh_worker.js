// The mesh worker: a third instance of the viewer's module, which makes meshes and compares them (viewer/src/mesh_worker).
import init, { mesh_worker_start, speak } from "./semascan_viewer.js";

// Orders may come before the module is ready: they wait here.
const waiting = [];
self.onmessage = async ({ data }) => {
  self.onmessage = (order) => waiting.push(order);
  try {
    await init({ module_or_path: data.module });
    if (data.messages) speak(data.language, data.messages);
    mesh_worker_start();
    waiting.forEach((order) => self.onmessage(order));
  } catch (error) {
    // Thrown outside the promise, so that the page's worker.onerror hears it.
    setTimeout(() => { throw error; });
  }
};
