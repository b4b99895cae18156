import { describe, expect, it } from "vitest";
import { arranged } from "./sceneDockBridge";

const FRAME = { width: 360, height: 500 };
const BOX = { width: 120, height: 40 };
const at = (x: number, y: number) => ({ x, y, box: BOX });

describe("labels over the picture", () => {
  it("stay where they belong where there is room", () => {
    expect(arranged([at(100, 100), at(250, 300)], FRAME)).toEqual([
      { x: 100, y: 100 },
      { x: 250, y: 300 },
    ]);
  });

  it("stay within the frame", () => {
    for (const { x, y } of arranged([at(-400, 900), at(2000, -50)], FRAME)) {
      expect(x).toBeGreaterThanOrEqual(60);
      expect(x).toBeLessThanOrEqual(300);
      expect(y).toBeGreaterThanOrEqual(20);
      expect(y).toBeLessThanOrEqual(480);
    }
  });

  it("do not cover each other", () => {
    const crowds = [
      [at(180, 250), at(185, 255), at(500, 900)],
      [at(180, 0), at(180, 5), at(20, 300)],
      [at(180, 499), at(181, 490), at(20, 300)],
    ];
    for (const crowd of crowds) {
      const placed = arranged(crowd, FRAME);
      for (const [i, one] of placed.entries())
        for (const other of placed.slice(i + 1)) {
          const apart = Math.abs(one.x - other.x) >= BOX.width || Math.abs(one.y - other.y) >= BOX.height;
          expect(apart, JSON.stringify(placed)).toBe(true);
        }
    }
  });
});
