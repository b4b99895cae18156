/** Findings of the server's rules, as the page looks at them: by place, by what is being edited, in words. */
import type { Details, Language } from "../api/types";
import type { PendingValues, RuleDoc, RuleFinding, StationFindings } from "../api/rules";
import type { Translate } from "../texts/texts";
import { type Change, keyOf } from "./staged";

export const isBroken = (finding: RuleFinding): boolean => finding.verdict === "broken";

export const stationOf = (device: string): string => device.slice(0, Math.max(0, device.lastIndexOf("/")));

/** What the server is asked about: the pending changes, and the one that is being typed in place of its own. */
export function pendingOf(
  changes: Iterable<Pick<Change, "device" | "address" | "raw">>,
  typed?: Pick<Change, "device" | "address" | "raw">,
): PendingValues {
  const pending: PendingValues = {};
  for (const { device, address, raw } of [...changes, ...(typed ? [typed] : [])])
    pending[device] = { ...pending[device], [address]: raw };
  return pending;
}

/** Broken rules by the objects that they mark. */
export function byPlace(stations: readonly StationFindings[]): ReadonlyMap<string, readonly RuleFinding[]> {
  const found = new Map<string, RuleFinding[]>();
  for (const finding of stations.flatMap((one) => one.findings).filter(isBroken))
    for (const { device, address } of finding.places) {
      const key = keyOf(device, address);
      found.set(key, [...(found.get(key) ?? []), finding]);
    }
  return found;
}

const marks = (finding: RuleFinding, device: string, address: string): boolean =>
  finding.places.some((place) => place.device === device && place.address === address);

/** What is to be said beside one object: broken rules that mark it, and rules about it that could not be judged. */
export function about(
  findings: readonly RuleFinding[],
  rules: readonly RuleDoc[],
  device: string,
  descriptionId: string,
  address: string,
): RuleFinding[] {
  const looking = new Set(
    rules
      .filter((rule) => rule.objects[descriptionId]?.some((one) => shortOf(one) === address))
      .map((rule) => rule.id),
  );
  return findings.filter((one) => (isBroken(one) ? marks(one, device, address) : looking.has(one.rule)));
}

/** Rules write some addresses with a sub-index of 0, the page does not. */
const shortOf = (address: string): string => address.replace(/:00$/, "");

/** Findings that come with the changes: those that mark an object that is pending. */
export const touching = (findings: readonly RuleFinding[], pending: PendingValues): RuleFinding[] =>
  findings.filter(
    (one) =>
      isBroken(one) && one.places.some(({ device, address }) => pending[device]?.[address] !== undefined),
  );

/** What is wrong, or not known, in one line. */
export function lineOfFinding(finding: RuleFinding, t: Translate): string {
  if (!isBroken(finding)) return t("rule.not_checked", finding.details);
  const details: Details = {};
  for (const [name, one] of Object.entries(finding.details)) details[name] = spoken(one, t.language);
  return t(`rule.${finding.rule}.broken`, details);
}

const spoken = (detail: number | string, language: Language): string =>
  typeof detail === "number" && language === "de" ? String(detail).replace(".", ",") : String(detail);

/** The rule behind a finding: what should be, why, and whether the value was ever set. */
export function reasonOfFinding({ rule, details }: RuleFinding, t: Translate): string {
  const said = [t("page.rules.rule", { title: t(`rule.${rule}.title`) }), t(`rule.${rule}.why`)];
  if ("at_default" in details) said.push(`${t("rule.at_default", details)}.`);
  return said.join(" ");
}

/** Several findings of one rule differ by their places. */
export const findingKey = (finding: RuleFinding): string =>
  [finding.rule, ...finding.places.map((one) => keyOf(one.device, one.address))].join();
