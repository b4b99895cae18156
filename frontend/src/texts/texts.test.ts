import { describe, expect, it } from "vitest";
import { translator } from "./texts";

const t = translator(
  { hello: "{who} has {count} ({missing})", abort: "value out of range", why: "{device}: {reason}" },
  "en",
);

describe("texts", () => {
  it("fill their placeholders, a dash where nothing is known", () => {
    expect(t("hello", { who: "PMC", count: 3 })).toBe("PMC has 3 (–)");
  });

  it("show the key where there is no text", () => {
    expect(t("no.such.key")).toBe("no.such.key");
    expect(t.has("no.such.key")).toBe(false);
    expect(t.nameOf("battery")).toBe("battery");
  });

  it("name an entry of an array after both, as far as there are names", () => {
    const de = translator(
      { "name.drive data": "Antrieb", "name.limit": "Grenze", "name.a: b": "eins" },
      "de",
    );
    expect(de.nameOf("drive data: limit")).toBe("Antrieb: Grenze");
    expect(de.nameOf("drive data: else")).toBe("Antrieb: else");
    expect(de.nameOf("a: b")).toBe("eins");
  });

  it("look up details that are keys themselves", () => {
    expect(t("why", { device: "PMM", text_key_reason: "abort" })).toBe("PMM: value out of range");
    expect(t("why", { device: "PMM", reason_key: "abort" })).toBe("PMM: value out of range");
    expect(t("why", { device: "PMM", reason_key: "abort", reason: "plain" })).toBe("PMM: value out of range");
  });
});
