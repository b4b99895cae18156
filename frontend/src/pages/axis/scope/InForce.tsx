import { Checkbox } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { type CaptureHead, type InForceRow, inForceQuery } from "../../../api/scope";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { useDeviceName } from "../../../ui/devices";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import classes from "./Scope.module.css";

/** The parameter values that were in force at the trigger, beside what is known now. */
export function InForce({ head }: { head: CaptureHead }) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  const count = head.devices.reduce((sum, one) => sum + one.values, 0);
  return (
    <details className={classes.inForce} open={open} onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary data-testid="in-force">
        {t("page.scope.parameters")} <span className="dim">({count})</span>
      </summary>
      {open && <Rows head={head} />}
    </details>
  );
}

function Rows({ head }: { head: CaptureHead }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const { data, error } = useQuery(inForceQuery(head.id));
  const [different, setDifferent] = useState(false);
  const [parameters, setParameters] = useState(true);
  const rows = useMemo(
    () =>
      (data ?? []).filter(
        (row) => (!different || row.differs === true) && (!parameters || row.was.parameter),
      ),
    [data, different, parameters],
  );
  const columns = useMemo(() => columnsOf(nameOf, t), [nameOf, t]);
  if (error) return <ProblemAlert error={error} title={t("page.scope.view_failed")} />;
  return (
    <>
      <p className={classes.told}>
        {head.devices
          .map((one) =>
            t("page.scope.parameters_unknown", { device: nameOf(one.device), count: one.unknown }),
          )
          .join(" · ")}
      </p>
      <div className={classes.inForceTable}>
        <DataTable
          label={t("page.scope.parameters")}
          rows={rows}
          columns={columns}
          idOf={(row) => `${row.was.device} ${row.was.address}`}
          fileName="hubside-in-force"
          empty={t("page.scope.parameters_none")}
          name="in-force"
          dense
          toneOf={(row) => (row.differs === true ? "warning" : "")}
          tools={
            <>
              <Checkbox
                label={t("page.scope.parameters_only")}
                checked={parameters}
                onChange={(event) => setParameters(event.currentTarget.checked)}
              />
              <Checkbox
                label={t("page.scope.parameters_different")}
                checked={different}
                onChange={(event) => setDifferent(event.currentTarget.checked)}
                data-testid="only-different"
              />
            </>
          }
        />
      </div>
    </>
  );
}

function columnsOf(nameOf: (slug: string) => string, t: Translate): TableColumn<InForceRow>[] {
  const shown = (text: string | null, unit: string) =>
    text === null ? "–" : `${localise(text, t.language)} ${unit}`.trim();
  return [
    {
      id: "address",
      title: t("page.scope.parameter_address"),
      width: "84px",
      text: (row) => row.was.address,
      fixed: true,
    },
    {
      id: "name",
      title: t("page.scope.parameter_name"),
      width: "minmax(180px, 2fr)",
      text: (row) => t.nameOf(row.was.title),
    },
    {
      id: "device",
      title: t("page.scope.parameter_device"),
      width: "minmax(110px, 1fr)",
      text: (row) => nameOf(row.was.device),
    },
    {
      id: "was",
      title: t("page.scope.parameter_was"),
      width: "minmax(120px, 1fr)",
      numeric: true,
      text: (row) => {
        const plain = shown(row.was.shown, row.was.unit);
        return row.was.name_key === null ? plain : `${plain} ${t(row.was.name_key)}`;
      },
    },
    {
      id: "now",
      title: t("page.scope.parameter_now"),
      width: "minmax(100px, 1fr)",
      numeric: true,
      text: (row) => shown(row.now_shown, row.was.unit),
    },
    {
      id: "state",
      title: t("page.scope.parameter_state"),
      width: "minmax(130px, 1fr)",
      text: (row) => stateOf(row, t),
    },
  ];
}

function stateOf(row: InForceRow, t: Translate): string {
  const compared =
    row.differs === null
      ? t("page.scope.parameter_not_known")
      : t(row.differs ? "page.scope.parameter_differs" : "page.scope.parameter_same");
  const stored = row.was.stored === null ? [] : [t(`page.scope.parameter_${row.was.stored}`)];
  const stale = row.was.stale ? [t("page.scope.parameter_stale")] : [];
  return [compared, ...stored, ...stale].join(", ");
}
