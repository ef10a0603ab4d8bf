// 3Dconnexion's SpaceMouse by WebHID: reads how far the puck is moved on each axis, and tells the viewer with each frame of the
// screen for as long as it is. A browser that lets no page speak with devices has no such command.
//
// Reports, little-endian 16 bit, about -350 to 350: 1 holds the translation (right, towards the person, down), and with newer
// devices the rotation about these axes after it; 2 holds the rotation; 3 the buttons, one bit each.

/** Multi-axis controllers on the desktop (HID usage tables, page 1, usage 8) of the two makers' numbers that the device has had. */
const FILTERS = [0x256f, 0x046d].map((vendorId) => ({ vendorId, usagePage: 0x01, usage: 0x08 }));

/** What the axes give at the end of their way. */
const WHOLE_WAY = 350;

const isPuck = (device) =>
  FILTERS.some(({ vendorId }) => device.vendorId === vendorId) &&
  device.collections.some(({ usagePage, usage }) => usagePage === FILTERS[0].usagePage && usage === FILTERS[0].usage);

const connected = new WeakSet();
let listens = false;

/**
 * Has the pucks move the camera that this page may already use, or, if `ask`, one that the person chooses.
 * @param viewer the running viewer
 * @param {boolean} ask
 */
export async function connect(viewer, ask) {
  const { hid } = navigator;
  if (!hid) return;
  if (!listens) {
    listens = true;
    hid.addEventListener("connect", ({ device }) => isPuck(device) && follow(viewer, device));
    hid.addEventListener("disconnect", ({ device }) => {
      if (!connected.delete(device)) return;
      held.translation.fill(0);
      held.rotation.fill(0);
      viewer.puck_is_there(undefined);
    });
  }
  const devices = ask ? await hid.requestDevice({ filters: FILTERS }) : await hid.getDevices();
  for (const device of devices.filter(isPuck)) await follow(viewer, device);
}

const held = { translation: new Float32Array(3), rotation: new Float32Array(3) };
/** Until when the viewer knows how the puck was held; null while it is not. */
let told = null;

async function follow(viewer, device) {
  if (connected.has(device)) return;
  if (!device.opened) await device.open();
  connected.add(device);
  viewer.puck_is_there(device.productName || "SpaceMouse");
  let buttons = 0;
  device.addEventListener("inputreport", ({ reportId, data }) => {
    // What was held until now counts, however seldom a frame is drawn.
    tell(viewer);
    const axes = (into, at) => {
      for (let k = 0; k < 3; k++) into[k] = Math.max(-1, Math.min(1, data.getInt16(at + 2 * k, true) / WHOLE_WAY));
    };
    if (reportId === 1 && data.byteLength >= 6) {
      axes(held.translation, 0);
      if (data.byteLength >= 12) axes(held.rotation, 6);
    } else if (reportId === 2 && data.byteLength >= 6) {
      axes(held.rotation, 0);
    } else if (reportId === 3 && data.byteLength >= 1) {
      const now = data.getUint8(0);
      if (now & ~buttons & 1) viewer.fit();
      buttons = now;
    }
    if (told === null && isHeld()) {
      told = performance.now();
      requestAnimationFrame(() => move(viewer));
    }
  });
}

const isHeld = () => [...held.translation, ...held.rotation].some((way) => way !== 0);

/** Moves the camera by how the puck was held since the last time. */
function tell(viewer) {
  if (told === null) return;
  const now = performance.now();
  viewer.move_puck(held.translation, held.rotation, (now - told) / 1000);
  told = now;
}

/** The same with each frame of the screen, until the puck is let go. */
function move(viewer) {
  tell(viewer);
  if (isHeld()) requestAnimationFrame(() => move(viewer));
  else told = null;
}
