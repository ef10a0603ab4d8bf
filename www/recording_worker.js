// The recording worker: reads one recording (viewer/recording) and is ended. Its module is loaded here and nowhere else, so that only who
// opens a recording loads it.
import init, { read_recording } from "./semascan_recording.js";

self.onmessage = async ({ data }) => {
  try {
    await init();
    const opened = read_recording(data.name, new Uint8Array(data.bytes));
    self.postMessage({ opened }, [opened.bytes.buffer]);
  } catch (reason) {
    self.postMessage({ reason: typeof reason === "string" ? reason : String(reason?.message ?? reason) });
  }
};
