/** All plots as one picture, with title, units, legend and cursors; made in the browser, with no network. */
import type UPlot from "uplot";
import { downloadBlob } from "../../../ui/export";
import type { PlotGroup, Trace } from "./traces";
import type { Pair } from "./view";

const PAD = 16;
const TITLE_PX = 17;
const SMALL_PX = 12;
const LINE_PX = 18;
const UNIT_PX = 18;

export interface Picture {
  title: string;
  /** Below the title: turbine, time, person. */
  about: string;
  /** What is drawn, with the heading of each. */
  plots: readonly { made: UPlot; heading: string }[];
  legend: readonly { trace: Trace; text: string }[];
  /** Of the axis below the last plot. */
  axis: string;
  /** Both cursors and what lies between them; empty without any. */
  between: string;
  view: Pair;
  cursors: Pair | null;
}

/** Null where nothing is drawn. */
export function pictureOf(picture: Picture, page: HTMLElement): HTMLCanvasElement | null {
  const { plots, legend } = picture;
  const first = plots[0];
  if (!first) return null;
  const ratio = devicePixelRatio;
  const style = getComputedStyle(page);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const width = first.made.ctx.canvas.width / ratio + 2 * PAD;
  const heights = plots.map(({ made }) => made.ctx.canvas.height / ratio + UNIT_PX);
  const head = PAD + TITLE_PX + LINE_PX + 8;
  const height =
    head +
    heights.reduce((sum, one) => sum + one, 0) +
    LINE_PX * (legend.length + (picture.between === "" ? 1 : 2)) +
    PAD;
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const brush = canvas.getContext("2d");
  if (!brush) return null;
  brush.scale(ratio, ratio);
  brush.fillStyle = colour("--hs-panel");
  brush.fillRect(0, 0, width, height);
  const write = (text: string, x: number, y: number, size: number, weight: number, ink: string) => {
    brush.font = `${weight} ${size}px ${style.fontFamily}`;
    brush.fillStyle = ink;
    brush.fillText(text, x, y);
  };
  const ink = style.color;
  const dim = colour("--hs-dim");
  write(picture.title, PAD, PAD + TITLE_PX - 3, TITLE_PX, 600, ink);
  write(picture.about, PAD, PAD + TITLE_PX + LINE_PX - 2, SMALL_PX, 400, dim);
  let top = head;
  plots.forEach(({ made, heading }, at) => {
    write(heading, PAD, top + UNIT_PX - 6, SMALL_PX, 600, ink);
    const { canvas: own } = made.ctx;
    brush.drawImage(own, PAD, top + UNIT_PX, own.width / ratio, own.height / ratio);
    paintCursors(brush, picture, made, top + UNIT_PX, ink);
    top += heights[at] ?? 0;
  });
  brush.textAlign = "center";
  write(picture.axis, width / 2, top + SMALL_PX, SMALL_PX, 400, dim);
  brush.textAlign = "left";
  top += LINE_PX + 6;
  if (picture.between !== "") {
    write(picture.between, PAD, top + 10, SMALL_PX, 600, ink);
    top += LINE_PX;
  }
  for (const { trace, text } of legend) {
    brush.beginPath();
    brush.moveTo(PAD, top + 6);
    brush.lineTo(PAD + 22, top + 6);
    brush.strokeStyle = colour(`--scope-${trace.colour}`);
    brush.lineWidth = 2.5;
    brush.setLineDash([...trace.dash]);
    brush.stroke();
    brush.setLineDash([]);
    write(text, PAD + 30, top + 10, SMALL_PX, 400, ink);
    top += LINE_PX;
  }
  return canvas;
}

function paintCursors(
  brush: CanvasRenderingContext2D,
  { view, cursors }: Picture,
  made: UPlot,
  top: number,
  ink: string,
) {
  const ratio = devicePixelRatio;
  const { left, width, top: inner, height } = made.bbox;
  cursors?.forEach((atS, at) => {
    if (atS < view[0] || atS > view[1]) return;
    const x = PAD + (left + ((atS - view[0]) / (view[1] - view[0])) * width) / ratio;
    brush.beginPath();
    brush.moveTo(x, top + inner / ratio);
    brush.lineTo(x, top + (inner + height) / ratio);
    brush.strokeStyle = ink;
    brush.lineWidth = 1;
    brush.stroke();
    brush.fillStyle = ink;
    brush.fillText(at === 0 ? "A" : "B", x + 3, top + inner / ratio + SMALL_PX);
  });
}

export function savePicture(canvas: HTMLCanvasElement, name: string): void {
  canvas.toBlob((blob) => blob && downloadBlob(name, blob), "image/png");
}

/** What stands above a plot in a picture. */
export const headingOf = (group: PlotGroup, bits: string): string => (group.unit === "" ? bits : group.unit);
