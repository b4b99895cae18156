import { describe, expect, it } from "vitest";
import type { TraceLine } from "../../api/trace";
import { partsOf } from "./fdlParts";

const FDL = { source: 2, destination: 6, dsap: null, ssap: null, pkw: false, sound: true };

const line = (data: string, parts: Partial<TraceLine> = {}, fdl: Partial<typeof FDL> = {}) =>
  partsOf({ data, step: null, fdl: { ...FDL, ...fdl }, ...parts });

const shown = (parts: ReturnType<typeof partsOf>) =>
  parts.map((part) => `${part.name}=${part.bytes.join("")}`).join(" ");

describe("the parts of a telegram", () => {
  it("has a name for each byte of those without data", () => {
    expect(shown(line("100602495116"))).toBe("SD1=10 DA=06 SA=02 FC=49 FCS=51 ED=16");
    expect(shown(line("dc0302"))).toBe("SD4=DC DA=03 SA=02");
    expect(shown(line("e5"))).toBe("SC=E5");
  });

  it("tells access points from data", () => {
    const sap = { dsap: 60, ssap: 62 } as unknown as Partial<typeof FDL>;
    expect(shown(line("68050568868 26d3c3eef16".replace(" ", ""), { step: "slave-diag" }, sap))).toBe(
      "SD2=68 LE=05 LEr=05 SD2=68 DA=86 SA=82 FC=6D DSAP=3C SSAP=3E FCS=EF ED=16",
    );
  });

  it("tells PKW from process data", () => {
    const body = `${"11".repeat(8)}${"22".repeat(6)}`;
    const parts = line(
      `681111680602 5d${body}0016`.replace(" ", ""),
      { step: "data-exchange" },
      { pkw: true },
    );
    expect(shown(parts)).toBe(
      `SD2=68 LE=11 LEr=11 SD2=68 DA=06 SA=02 FC=5D pkw=${"11".repeat(8)} pzd=${"22".repeat(6)} FCS=00 ED=16`,
    );
    expect(parts.filter((part) => part.kind === "data").map((part) => part.name)).toEqual(["pkw", "pzd"]);
    expect(shown(line("a206025d11223344556677880016", { step: "data-exchange" }))).toContain(
      "pzd=1122334455667788",
    );
  });

  it("leaves in one piece what is no telegram", () => {
    expect(shown(line("6805", {}, { sound: false }))).toBe("broken=6805");
    expect(shown(line("ff00"))).toBe("broken=FF00");
  });
});
