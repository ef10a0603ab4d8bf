// The mesh worker: a third instance of the viewer's module, which makes meshes and compares them (viewer/src/mesh_worker).
import init, { mesh_worker_start, speak } from "./semascan_viewer.js";

// Decodes a picture for the module (viewer/src/mesh_worker/decoded.rs), which hands over bytes of its own memory.
self.decodePicture = async (bytes, largest) => {
  const bitmap = await createImageBitmap(new Blob([bytes.slice()]));
  const share = Math.min(1, largest / Math.max(bitmap.width, bitmap.height));
  const [width, height] = [bitmap.width, bitmap.height].map((side) => Math.max(1, Math.round(side * share)));
  const context = new OffscreenCanvas(width, height).getContext("2d");
  context.drawImage(bitmap, 0, 0, width, height);
  return context.getImageData(0, 0, width, height);
};

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
