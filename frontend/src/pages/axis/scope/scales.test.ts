import { describe, expect, it } from "vitest";
import { parseScales, scalesText, withScale } from "./scales";

describe("axes that were set by hand", () => {
  it("stand in the URL and come back", () => {
    const scales = withScale(withScale(new Map(), "unit °/s", [-5, 5.25]), "signal wtg-07/a:b", [0, 1]);
    const text = scalesText(scales);
    expect(parseScales(text)).toEqual(scales);
    expect(text).not.toContain(" ");
  });

  it("are automatic again", () => {
    const scales = withScale(new Map(), "unit mm", [0, 20]);
    expect(scalesText(withScale(scales, "unit mm", null))).toBeUndefined();
    expect([...withScale(scales, "unit mm", [1, 2])]).toEqual([["unit mm", [1, 2]]]);
  });

  it.each([undefined, "", "unit%20mm", "unit%20mm:5..5", "unit%20mm:9..1", "unit%20mm:a..b", ":;"])(
    "make no sense in %j",
    (text) => {
      expect(parseScales(text).size).toBe(0);
    },
  );

  it("outlive a link that was cut off", () => {
    expect([...parseScales("unit%:1..2")]).toEqual([["unit%", [1, 2]]]);
  });
});
