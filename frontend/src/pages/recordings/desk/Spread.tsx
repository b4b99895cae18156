import { useCallback, useSyncExternalStore } from "react";
import { useStore } from "../../../live/live";
import { fraction, times, toNumber } from "../../../model/decimal";
import { quantityOf } from "../../../model/values";
import { figure } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { rawOf } from "../../parameters/cellValue";
import classes from "./Desk.module.css";
import { unitsOf } from "./looks";
import type { DeskSignal } from "./signals";

/** How far the signals disagree at the cursor. */
export function Spread({ signals }: { signals: readonly DeskSignal[] }) {
  const t = useTexts();
  const store = useStore();
  const unit = unitsOf(signals)[0] ?? "";
  const own = signals.filter((one) => one.unit === unit);
  const subscribe = useCallback(
    (listener: () => void) => {
      const ends = own.map(({ line }) => store.subscribe(`value:${line.device}/${line.address}`, listener));
      return () => {
        for (const end of ends) end();
      };
    },
    // eslint-disable-next-line react-hooks/exhaustive-deps -- `own` is made of `signals`
    [store, signals],
  );
  const read = () => {
    const numbers = own.flatMap((one) => numberOf(one, rawOf(store.cell(one.line.device, one.line.address))));
    if (numbers.length < 2) return "–";
    return figure(Math.max(...numbers) - Math.min(...numbers), own[0]?.decimals ?? 0, t.language);
  };
  const text = useSyncExternalStore(subscribe, read);
  return (
    <div className={classes.line} title={t("desk.spread_why")} data-testid="spread">
      <span className={classes.bandSwatch} aria-hidden />
      <span>{t("desk.spread")}</span>
      <span className={classes.number}>{text}</span>
      <span />
    </div>
  );
}

function numberOf({ entry, context }: DeskSignal, raw: number | string | null): number[] {
  const exact = raw === null ? null : fraction(String(raw));
  return exact === null ? [] : [toNumber(times(exact, quantityOf(entry, context.lookup).scale))];
}
