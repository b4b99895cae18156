import { describe, expect, it } from "vitest";
import type { EntryDoc } from "../api/types";
import { categoriesOf, savesFor } from "./saving";

const entry = (address: string, save_category: string | null, saved = true) =>
  ({ address, save_category, saved }) as EntryDoc;

const save = [null, "application", "tuning", "profibus"].map((category, at) => ({
  address: `1010:0${at + 1}`,
  category,
}));
const entries = [
  entry("6065", "application"),
  entry("2031", "tuning"),
  entry("1020:01", null),
  entry("6041", null, false),
  entry("2010", "ethernet"),
];
const doc = { save, entries };

describe("what a device saves by", () => {
  it("offers the categories that hold a parameter", () => {
    expect(categoriesOf(doc)).toEqual(["application", "tuning"]);
    expect(categoriesOf({ save: save.slice(0, 1), entries: [entry("6065", null)] })).toEqual([]);
  });

  it("saves each category of what was written, once and in the order of the commands", () => {
    expect(savesFor(doc, ["2031", "6065", "2031"])).toEqual(["application", "tuning"]);
    expect(savesFor(doc, ["1020:01", "2031"])).toEqual(["tuning"]);
  });

  it("saves all where no category is enough, and nothing where nothing is kept", () => {
    expect(savesFor(doc, ["1020:01"])).toEqual([null]);
    expect(savesFor(doc, ["2010"])).toEqual([null]);
    expect(savesFor(doc, ["6041"])).toEqual([]);
  });
});
