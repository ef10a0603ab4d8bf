// What does not fit a page: targets that are too small to be hit, and what reaches beyond its edges.

/** Side of the smallest target, CSS pixels (WCAG 2.2, success criterion 2.5.8). */
const LEAST = 24;

/** Names of what is too small, of what reaches beyond the page, and how far the page scrolls sideways. */
export function misfits(page) {
  return page.evaluate((least) => {
    const name = (element) => element.dataset.testid || element.id || element.className || element.tagName;
    const seen = (element) => element.checkVisibility({ opacityProperty: false, visibilityProperty: true });
    const small = [];
    for (const element of document.querySelectorAll('button, input, select, a[href], summary, [role=button]')) {
      // What a control's label covers belongs to the target.
      const target = element.closest('label') ?? element;
      if (!seen(target) || target.classList.contains('skip')) continue;
      const { width, height } = target.getBoundingClientRect();
      if (Math.min(width, height) < least - 0.01) small.push(`${name(element)}: ${width.toFixed(1)} x ${height.toFixed(1)}`);
    }
    const page = document.documentElement;
    const wide = [...document.querySelectorAll('#panels *, #header *, #overlay *')].filter((element) => {
      const { left, right, width } = element.getBoundingClientRect();
      const scrolls = element.closest('.segments.is-raised, .strip');
      return width > 1 && seen(element) && !scrolls && !element.closest('.visually-hidden') && (right > page.clientWidth + 1 || left < -1);
    });
    return { small, wide: wide.map(name), scroll: page.scrollWidth - page.clientWidth };
  }, LEAST);
}
