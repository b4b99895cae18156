/**
 * When what has come is drawn: with the next animation frame, but not more often than twenty times a second. A bus tells
 * more than fifty changes a second; each would have the page render anew, and a key that is pressed meanwhile waits.
 */
export const DRAW_MS = 50;
const HIDDEN_TICK_MS = 250;

type Flush = () => void;

/** A schedule of its own for one store. A hidden page has no animation frames, so a slow timer then. */
export function paced(): (flush: Flush) => void {
  let drawnMs = -Infinity;
  return (flush) => {
    if (document.hidden) {
      setTimeout(flush, HIDDEN_TICK_MS);
      return;
    }
    const draw = () =>
      requestAnimationFrame(() => {
        drawnMs = performance.now();
        flush();
      });
    const waitMs = drawnMs + DRAW_MS - performance.now();
    if (waitMs > 0) setTimeout(draw, waitMs);
    else draw();
  };
}
