import { Button } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconCircleCheck, IconX } from "@tabler/icons-react";
import {
  type LineStation,
  type Order,
  type OrderCheck,
  ORDERS,
  useCheckOrder,
  useKeepOrder,
} from "../../api/lines";
import { NeedsRole } from "../../frame/NeedsRole";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import { type Translate, useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { entriesOf } from "../../ui/reading";
import classes from "./Line.module.css";

interface Props {
  station: LineStation;
  context: DeviceContext | null;
}

/** The order of bytes of the process data: what the site says, what is proven, and the guided check of it. */
export function OrderPanel({ station, context }: Props) {
  const t = useTexts();
  const check = useCheckOrder(station.device);
  const keep = useKeepOrder(station.device);
  const checked = keep.data ?? check.data;
  const hasPkw = station.telegram?.has_pkw === true;
  return (
    <section className={classes.order} aria-label={t("lines.order.title")} data-testid="order">
      <header>
        <h4>{t("lines.order.title")}</h4>
        <span data-testid="order-stand">
          {station.order !== null ? (
            <b className="tone-ok">
              <IconCircleCheck size={15} aria-hidden />{" "}
              {t("lines.order.proven", { order: t(`lines.orders.${station.order}`) })}
            </b>
          ) : (
            <b className="tone-warning">
              <IconAlertTriangle size={15} aria-hidden /> {t("lines.order.open")}
            </b>
          )}{" "}
          <span className="dim">
            {station.setting === null
              ? t("lines.order.not_set")
              : t("lines.order.set", { order: t(`lines.orders.${station.setting}`) })}
          </span>
        </span>
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              variant="default"
              disabled={locked || !hasPkw}
              loading={check.isPending}
              onClick={() => {
                keep.reset();
                check.mutate();
              }}
              data-testid="order-check"
            >
              {t("lines.order.check")}
            </Button>
          )}
        </NeedsRole>
      </header>
      {!hasPkw && <p className="dim">{t("lines.order.no_pkw")}</p>}
      {check.error !== null && <ProblemAlert error={check.error} title={t("lines.order.failed")} />}
      {checked !== undefined && (
        <>
          <Evidence checked={checked} context={context} />
          <Verdict
            checked={checked}
            kept={keep.isSuccess}
            busy={keep.isPending}
            onKeep={(order) => keep.mutate(order)}
          />
        </>
      )}
      {keep.error !== null && <ProblemAlert error={keep.error} title={t("lines.order.not_kept")} />}
    </section>
  );
}

/** What was read, what the bytes of that moment say by each order, and which of them agree. */
function Evidence({ checked, context }: { checked: OrderCheck; context: DeviceContext | null }) {
  const t = useTexts();
  return (
    <table className={classes.words} data-testid="order-evidence">
      <thead>
        <tr>
          <th scope="col">{t("lines.column.signal")}</th>
          <th scope="col">{t("lines.column.pkw")}</th>
          <th scope="col">{t("lines.column.bytes")}</th>
          {ORDERS.map((order) => (
            <th key={order} scope="col">
              {t(`lines.orders.${order}`)}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {checked.readings.map((reading) => (
          <tr key={reading.signal}>
            <th scope="row">{reading.signal}</th>
            <td>
              {reading.value} <small className="dim">{inUnits(reading, context)}</small>
            </td>
            <td>
              <code>{reading.data}</code>
            </td>
            {ORDERS.map((order) => {
              const said = reading.said[order];
              const fits = said === reading.value;
              return (
                <td key={order} className={fits ? "tone-ok" : "dim"}>
                  {fits ? <IconCheck size={14} aria-hidden /> : <IconX size={14} aria-hidden />} {said}
                  <span className="visually-hidden">
                    {" "}
                    {t(fits ? "lines.order.fits" : "lines.order.fits_not")}
                  </span>
                </td>
              );
            })}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** The read value with its unit, where that says more than the number; empty otherwise. */
function inUnits(reading: OrderCheck["readings"][number], context: DeviceContext | null): string {
  const entry = reading.address === null ? undefined : context && entriesOf(context.doc).get(reading.address);
  if (!entry || !context) return "";
  const shown = shownOf(entry, reading.value, context);
  return shown.unit === "" ? "" : lineOf(shown);
}

interface VerdictProps {
  checked: OrderCheck;
  kept: boolean;
  busy: boolean;
  onKeep: (order: Order) => void;
}

/** What follows, and the orders that may be noted in the site file. */
function Verdict({ checked, kept, busy, onKeep }: VerdictProps) {
  const t = useTexts();
  return (
    <div className={classes.verdict} data-testid="order-verdict">
      <p className={checked.proven === null ? "tone-warning" : "tone-ok"}>{verdictText(checked, t)}</p>
      {kept ? (
        <p className="tone-ok" role="status">
          <IconCircleCheck size={15} aria-hidden /> {t("lines.order.kept")}
        </p>
      ) : (
        checked.fits
          .filter((order) => order !== checked.setting)
          .map((order) => (
            <NeedsRole key={order} role="technician" device>
              {(locked) => (
                <Button
                  variant="light"
                  disabled={locked}
                  loading={busy}
                  onClick={() => onKeep(order)}
                  data-testid={`order-keep-${order}`}
                >
                  {t("lines.order.keep", { order: t(`lines.orders.${order}`) })}
                </Button>
              )}
            </NeedsRole>
          ))
      )}
    </div>
  );
}

function verdictText({ proven, reason_key: reason }: OrderCheck, t: Translate): string {
  if (proven !== null) return t("lines.order.is_proven", { order: t(`lines.orders.${proven}`) });
  return t("lines.order.not_proven", { reason: reason === null ? "–" : t(reason) });
}
