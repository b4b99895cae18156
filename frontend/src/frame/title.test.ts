import { describe, expect, it } from "vitest";
import { translator } from "../texts/texts";
import { titleOf } from "./title";

const t = translator(
  {
    "page.title.plain": "Hubside",
    "page.title.room": "{room} · Hubside",
    "page.title.turbine": "{room} · {turbine} · Hubside",
    "page.rooms.parameters": "Parameters",
  },
  "en",
);

describe("the title of the tab", () => {
  it("names room and turbine", () => {
    expect(titleOf("/parameters", "WTG-07", t)).toBe("Parameters · WTG-07 · Hubside");
  });

  it("names the room alone where nothing is connected, and nothing but the product where there is no room", () => {
    expect(titleOf("/parameters", undefined, t)).toBe("Parameters · Hubside");
    expect(titleOf("/nowhere", "WTG-07", t)).toBe("Hubside");
  });
});
