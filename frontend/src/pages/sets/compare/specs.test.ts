import { expect, it } from "vitest";
import { columnsIn, deviceOf, isLive, moved, withReference } from "./specs";

it("takes the columns of a link, each once, and leaves what is none", () => {
  const link = "live:wtg-07/blade-1/pmc, set:0195,nonsense,left:,year:a/b/c,set:0195";
  expect(columnsIn(link)).toEqual(["live:wtg-07/blade-1/pmc", "set:0195", "year:a/b/c"]);
  expect(columnsIn(undefined)).toEqual([]);
});

it("knows the device of a column, and which change while they are looked at", () => {
  expect(deviceOf("live:a/b/c")).toBe("a/b/c");
  expect(deviceOf("set:0195")).toBeNull();
  expect(["live:a", "editor:a", "stored:a", "found:a", "set:a"].map(isLive)).toEqual([
    true,
    true,
    true,
    false,
    false,
  ]);
});

it("changes the reference and the order", () => {
  const columns = ["live:a", "live:b", "live:c"];
  expect(withReference(columns, "live:c")).toEqual(["live:c", "live:a", "live:b"]);
  expect(moved(columns, "live:c", -1)).toEqual(["live:a", "live:c", "live:b"]);
  expect(moved(columns, "live:a", -1)).toEqual(columns);
  expect(moved(columns, "live:c", 1)).toEqual(columns);
});
