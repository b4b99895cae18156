/** What the page is made of, as its package names it; the licences are those of the packages. */
import { dependencies } from "../../../package.json";

const LICENCES: Record<string, string> = { "@fontsource-variable/inter": "OFL-1.1" };
const USUAL = "MIT";

export const PAGE_LIBRARIES = Object.entries(dependencies).map(([name, version]) => ({
  name,
  version,
  licence: LICENCES[name] ?? USUAL,
}));
