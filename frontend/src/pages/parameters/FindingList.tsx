import { IconAlertTriangle, IconCircleX, IconHelpCircle, IconInfoCircle } from "@tabler/icons-react";
import type { EntryDoc, Raw } from "../../api/types";
import { type Finding, FindingKind, Weight } from "../../model/findings";
import { titleOf } from "../../model/rows";
import { type DeviceContext, limitText, lineOf, shownOf } from "../../model/shown";
import { isHex, quantityOf } from "../../model/values";
import classes from "./Parameters.module.css";
import { entriesOf, plannedContext } from "./staging";

const ICONS = {
  [Weight.Stops]: IconCircleX,
  [Weight.Asks]: IconHelpCircle,
  [Weight.Warns]: IconAlertTriangle,
  [Weight.Tells]: IconInfoCircle,
};

interface Props {
  findings: readonly Finding[];
  entry: EntryDoc;
  device: DeviceContext;
}

export function FindingList({ findings, entry, device }: Props) {
  if (findings.length === 0) return null;
  return (
    <ul className={classes.findings}>
      {findings.map((finding) => {
        const Icon = ICONS[finding.weight];
        return (
          <li
            key={`${finding.kind} ${finding.other}`}
            data-weight={finding.weight}
            data-testid={`finding-${finding.kind}`}
          >
            <Icon size={16} aria-hidden />
            <span>{textOf(finding, entry, device)}</span>
          </li>
        );
      })}
    </ul>
  );
}

/** A finding in words: values in the unit of their object, other objects by address and name. */
export function textOf(finding: Finding, entry: EntryDoc, device: DeviceContext): string {
  const { t } = device;
  const { kind, other, details } = finding;
  const planned = plannedContext(device);
  const line = (of: EntryDoc, raw: unknown) => lineOf(shownOf(of, raw as Raw, planned));
  const about = other === null ? undefined : entriesOf(device.doc).get(other);
  const named = about ? `${about.address} ${titleOf(about, t)}` : other;
  switch (kind) {
    case FindingKind.Limit:
      return t("page.finding.limit", {
        limits: limitText(entry, planned, true),
        unit: isHex(entry) ? "" : quantityOf(entry, planned.lookup).unit,
      });
    case FindingKind.Locked:
      return t(`page.locked.${String(details.lock)}`);
    case FindingKind.Precondition: {
      const values = (details.values as number[]).map((raw) => (about ? line(about, raw) : raw));
      return t("page.finding.precondition", { other: named, values: values.join(", ") });
    }
    case FindingKind.Conflict:
      return t("page.finding.conflict", {
        from: line(entry, details.from),
        found: line(entry, details.found),
      });
    default:
      return t(`page.finding.${kind}`, { other: named, ...details });
  }
}
