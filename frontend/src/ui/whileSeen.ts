/** Drawing again and again: with an animation frame, never in the midst of something else, and only what is in view. */

/** Calls `draw` every `everyMs` while any of the element is in view, and as soon as it comes into view; the answer ends it. */
export function whileSeen(element: Element, everyMs: number, draw: () => void): () => void {
  let timer: ReturnType<typeof setInterval> | null = null;
  let frame: number | null = null;
  const ask = () => {
    frame ??= requestAnimationFrame(() => {
      frame = null;
      draw();
    });
  };
  const rest = () => {
    if (timer !== null) clearInterval(timer);
    if (frame !== null) cancelAnimationFrame(frame);
    timer = frame = null;
  };
  const observer = new IntersectionObserver((entries) => {
    rest();
    if (entries.at(-1)?.isIntersecting !== true) return;
    timer = setInterval(ask, everyMs);
    ask();
  });
  observer.observe(element);
  return () => {
    observer.disconnect();
    rest();
  };
}
