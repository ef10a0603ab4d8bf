// Chromium with a software rasterizer, one set of flags for each graphics backend of the viewer, or on the machine's
// graphics.

import { chromium } from 'playwright-core';

const EXECUTABLE = process.env.SEMASCAN_CHROMIUM ?? '/usr/bin/chromium';

/** Quiet on a closed network, and able to run as root in a container. */
const COMMON = [
  '--no-sandbox',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--force-color-profile=srgb',
];

/**
 * Flags by backend, named as `data-backend` names them. With fewer flags WebGPU finds an adapter and then loses the
 * device at the first frame.
 */
const FLAGS = {
  webgl2: ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  webgpu: [
    '--enable-unsafe-webgpu',
    '--use-vulkan=swiftshader',
    '--use-angle=swiftshader',
    '--enable-features=Vulkan',
  ],
  // A machine whose graphics are blocked, as by some company policies.
  none: ['--disable-gpu', '--disable-3d-apis'],
};

/**
 * Flags for the machine's own graphics on either backend: through Vulkan, which needs no screen. Without a fit driver
 * the page may get software in its place, or nothing, or the browser may end.
 */
const HARDWARE = [
  '--ignore-gpu-blocklist',
  '--enable-unsafe-webgpu',
  // For the adapter's name in full.
  '--enable-webgpu-developer-features',
  '--use-angle=vulkan',
  '--enable-features=Vulkan',
  '--disable-vulkan-surface',
];

/** The graphics backends that the viewer must work on. */
export const BACKENDS = ['webgl2', 'webgpu'];

/** Size of the page in every test: small, because every pixel is drawn by the processor. */
export const VIEWPORT = { width: 960, height: 600 };

/** Starts a browser for a backend (`none`: without any), with a profile of its own; `hardware`: on the machine's. */
export function launch(backend, { hardware = false } = {}) {
  const args = [...COMMON, ...(hardware ? HARDWARE : FLAGS[backend])];
  return chromium.launch({ executablePath: EXECUTABLE, headless: true, args });
}

/** Opens an empty page whose looks and language do not depend on the machine. */
export async function newPage(browser, viewport = VIEWPORT, locale = 'en-GB') {
  const context = await browser.newContext({
    viewport,
    deviceScaleFactor: 1,
    colorScheme: 'dark',
    reducedMotion: 'reduce',
    locale,
    acceptDownloads: true,
  });
  return context.newPage();
}
