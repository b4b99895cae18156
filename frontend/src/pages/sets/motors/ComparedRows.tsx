import { IconAlertTriangle, IconCheck, IconLink, IconQuestionMark } from "@tabler/icons-react";
import type { MotorComparison, MotorForm, Side } from "../../../api/motors";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { wordsOf } from "./MotorContent";
import { labelOf } from "./motorDraft";
import classes from "./Motors.module.css";
import { titleOf } from "./places";

interface Props {
  doc: MotorComparison;
  form: MotorForm;
  /** Those that are the same too. */
  all: boolean;
}

interface Row {
  key: string;
  name: string;
  state: MotorComparison["values"][number]["state"];
  left: string;
  right: string;
}

/** What stands first is what differs. */
const ORDER = ["different", "missing", "unit", "same"] as const;

export function ComparedRows({ doc, form, all }: Props) {
  const t = useTexts();
  const deviceName = useDeviceName();
  const rows = useRows(doc, form).filter((row) => all || row.state !== "same");
  const nameOf = (side: Side) =>
    side.motor ? `${titleOf(side.motor)} @${side.motor.version}` : deviceName(side.device ?? "");
  return (
    <table className={classes.values} style={{ marginTop: 8 }}>
      <thead>
        <tr>
          <th>{t("page.motors.what")}</th>
          <th data-number="true">{nameOf(doc.left)}</th>
          <th data-number="true">{nameOf(doc.right)}</th>
          <th>{t("page.motors.state")}</th>
        </tr>
      </thead>
      <tbody>
        {rows.map((row) => (
          <tr key={row.key} data-state={row.state} data-testid={`compared-${row.key}`}>
            <td>{row.name}</td>
            <td data-number="true">{row.left}</td>
            <td data-number="true">{row.right}</td>
            <td>
              <StateSign state={row.state} />
            </td>
          </tr>
        ))}
        {rows.length === 0 && (
          <tr>
            <td colSpan={4} className="dim">
              {t("page.motors.all_same")}
            </td>
          </tr>
        )}
      </tbody>
    </table>
  );
}

function useRows(doc: MotorComparison, form: MotorForm): Row[] {
  const t = useTexts();
  const plate = doc.plate.map((row): Row => {
    const unit = form.plate.find((field) => field.name === row.field)?.unit ?? "";
    const words = (found: number | string | null) =>
      found === null
        ? "–"
        : typeof found === "number"
          ? `${localise(String(found), t.language)} ${unit}`.trim()
          : found;
    return {
      key: row.field,
      name: t(`motor.field.${row.field}`),
      state: row.state,
      left: words(row.left),
      right: words(row.right),
    };
  });
  const values = doc.values.flatMap((row): Row[] => {
    const entry = form.description.entries.find((one) => one.address === row.address);
    if (!entry) return [];
    const name = `${row.address} ${labelOf(entry, t)}`;
    const [left, right] = [wordsOf(form, entry, row.left, t), wordsOf(form, entry, row.right, t)];
    return [{ key: row.address, name, state: row.state, left, right }];
  });
  return [...plate, ...values].toSorted((a, b) => ORDER.indexOf(a.state) - ORDER.indexOf(b.state));
}

const SIGNS = {
  different: { Icon: IconAlertTriangle, tone: "tone-warning" },
  missing: { Icon: IconQuestionMark, tone: "dim" },
  unit: { Icon: IconLink, tone: "dim" },
  same: { Icon: IconCheck, tone: "tone-ok" },
};

function StateSign({ state }: { state: Row["state"] }) {
  const t = useTexts();
  const { Icon, tone } = SIGNS[state];
  return (
    <span className={`${classes.sign} ${tone}`}>
      <Icon size={14} aria-hidden /> {t(`motor.state.${state}`)}
    </span>
  );
}
