import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { parse } from "smol-toml";
import type { Plugin } from "vite";

const ID = "virtual:boot-texts";
const LANGUAGES = ["en", "de"];

/**
 * The few texts that are needed before the catalogue can be fetched (no access, no server) are taken from that same
 * catalogue when the page is built: the table `page.boot`.
 */
export function bootTexts(): Plugin {
  return {
    name: "hubside-boot-texts",
    resolveId: (id) => (id === ID ? `\0${ID}` : null),
    load(id) {
      if (id !== `\0${ID}`) return null;
      for (const language of LANGUAGES) this.addWatchFile(fileOf(language));
      return `export default ${JSON.stringify(Object.fromEntries(LANGUAGES.map((one) => [one, bootTable(one)])))};`;
    },
  };
}

const fileOf = (language: string): string =>
  fileURLToPath(new URL(`../../app/locales/${language}.toml`, import.meta.url));

function bootTable(language: string): Record<string, string> {
  const page = parse(readFileSync(fileOf(language), "utf-8")).page as
    { boot?: Record<string, string> } | undefined;
  // That no key is missing is for the tests to say (texts/catalogue.test.ts): here a missing text shows its key.
  return Object.fromEntries(
    Object.entries(page?.boot ?? {}).map(([key, text]) => [`page.boot.${key}`, text]),
  );
}
