/** Colours of nodes in a plot: alike in brightness, far apart in hue, readable on light and dark. */

const COLOURS = ["#4c9be8", "#e8894c", "#58b368", "#c46bd6", "#d6b13f", "#46b5b0", "#e06c8b", "#8f8ae6"];

export function nodeColours(nodes: readonly number[]): ReadonlyMap<number, string> {
  const sorted = [...nodes].filter((node) => node > 0).sort((a, b) => a - b);
  return new Map(sorted.map((node, at) => [node, COLOURS[at % COLOURS.length] ?? "#888888"]));
}
