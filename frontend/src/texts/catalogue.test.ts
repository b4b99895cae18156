/** The page uses no key that the catalogue lacks, in any language. */
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { parse } from "smol-toml";
import { describe, expect, it } from "vitest";

const SOURCE = fileURLToPath(new URL("..", import.meta.url));

function keysOf(table: Record<string, unknown>, prefix: string): string[] {
  return Object.entries(table).flatMap(([key, value]) =>
    typeof value === "object" && value !== null
      ? keysOf(value as Record<string, unknown>, `${prefix}${key}.`)
      : [`${prefix}${key}`],
  );
}

function catalogue(language: string): string[] {
  const file = new URL(`../../../app/locales/${language}.toml`, import.meta.url);
  return keysOf(parse(readFileSync(file, "utf-8")), "").filter((key) => key.startsWith("page."));
}

const sources = readdirSync(SOURCE, { recursive: true, encoding: "utf-8" })
  .filter((name) => /\.tsx?$/.test(name) && !name.includes(".test."))
  .map((name) => readFileSync(`${SOURCE}/${name}`, "utf-8"))
  .join("\n");

/** Keys written out, and patterns of those that are put together: `page.mode.${shown}`. */
const plain = [...sources.matchAll(/"(page(?:\.\w+)+)"/g)].map((match) => match[1] ?? "");
const patterns = [...sources.matchAll(/`(page\.[^`]*\$\{[^`]+)`/g)].map((match) => match[1] ?? "");

const asRegex = (pattern: string): RegExp =>
  new RegExp(
    `^${pattern
      .split(/\$\{[^}]*\}/)
      .map((piece) => piece.replaceAll(".", "\\."))
      .join("\\w+")}$`,
  );

describe.each(["en", "de"])("catalogue %s", (language) => {
  const keys = new Set(catalogue(language));

  it("has every key that is written out in the source", () => {
    expect(plain.length).toBeGreaterThan(80);
    expect(plain.filter((key) => !keys.has(key))).toEqual([]);
  });

  it("has a key for every pattern that is put together in the source", () => {
    expect(patterns.length).toBeGreaterThan(10);
    expect(patterns.filter((pattern) => ![...keys].some((key) => asRegex(pattern).test(key)))).toEqual([]);
  });

  it("has the same keys as English", () => {
    expect([...keys].sort()).toEqual(catalogue("en").sort());
  });
});
