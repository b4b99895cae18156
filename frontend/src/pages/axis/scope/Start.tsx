import { Button } from "@mantine/core";
import { IconCheck } from "@tabler/icons-react";
import type { ReactNode } from "react";
import type { CaptureLine } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import { type Draft, MAX_SIGNALS, orderOf } from "./draft";
import type { Options } from "./options";
import classes from "./Scope.module.css";

export type Side = "signals" | "trigger" | "captures";
const LATEST = 3;

interface Props {
  draft: Draft;
  options: Options;
  chosen: readonly string[];
  locked: boolean;
  captures: readonly CaptureLine[];
  onSide: (side: Side) => void;
}

/** While nothing is armed: what is set up already, what is still missing, and the latest captures. */
export function Start({ draft, options, chosen, locked, captures, onSide }: Props) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const ready = orderOf(draft, chosen) !== null;
  return (
    <section className={classes.start} aria-label={t("page.scope.start")} data-testid="scope-start">
      {!locked && (
        <ol>
          <Step
            done={chosen.length > 0}
            title={t("page.scope.step_signals")}
            told={
              chosen.length === 0
                ? t("page.scope.chosen_none")
                : t("page.scope.chosen", { count: chosen.length, limit: MAX_SIGNALS })
            }
          >
            <Button variant="default" onClick={() => onSide("signals")}>
              {t("page.scope.step_change")}
            </Button>
          </Step>
          <Step
            done={ready || chosen.length === 0}
            title={t("page.scope.step_trigger")}
            told={triggerText(draft, options, t)}
          >
            <Button variant="default" onClick={() => onSide("trigger")} data-testid="step-trigger">
              {t("page.scope.step_change")}
            </Button>
          </Step>
          <Step
            done={false}
            title={t("page.scope.step_arm")}
            told={t(ready ? "page.scope.step_arm_ready" : "page.scope.arm_missing")}
          />
        </ol>
      )}
      {captures.length === 0 ? (
        <p className={classes.told}>{t("page.scope.captures_none")}</p>
      ) : (
        <>
          <h2>{t("page.scope.latest")}</h2>
          <ul>
            {captures.slice(0, LATEST).map((one) => (
              <li key={one.id}>
                <Button
                  variant="subtle"
                  onClick={() => update({ capture: one.id, zoom: undefined, cursors: undefined })}
                >
                  {one.name}
                </Button>
                <span className="dim">
                  {[
                    one.turbine_name,
                    dayAndTime(one.trigger_ns / 1e6),
                    t(`page.scope.cause_${one.cause}`),
                  ].join(" · ")}
                </span>
              </li>
            ))}
          </ul>
        </>
      )}
    </section>
  );
}

function Step(props: { done: boolean; title: string; told: string; children?: ReactNode }) {
  const t = useTexts();
  return (
    <li data-done={props.done}>
      <i aria-hidden>{props.done && <IconCheck size={16} />}</i>
      <span>
        <strong>{props.title}</strong>
        {props.done && <span className={classes.hidden}>{t("page.scope.step_done")}</span>}
        <small>{props.told}</small>
      </span>
      {props.children}
    </li>
  );
}

/** "Edge: Blade 1 PMC position actual value, falling, 45 °. 4 s, of which 1 s before the trigger." */
function triggerText(draft: Draft, options: Options, t: Translate): string {
  const number = (value: number) => localise(String(value).replace("-", "−"), t.language);
  const span = t("page.scope.step_span", { total: number(draft.totalS), pre: number(draft.preS) });
  return `${[t(`page.scope.kind_${draft.kind}`), ...conditionOf(draft, options, number, t)].join(", ")}. ${span}`;
}

function conditionOf(
  draft: Draft,
  options: Options,
  number: (value: number) => string,
  t: Translate,
): string[] {
  const { kind } = draft;
  if (kind === "manual") return [];
  const device = options.devices.find(({ value }) => value === draft.device)?.label;
  const whose = device ?? t("page.scope.device_any");
  if (kind === "fault") return [whose, ...(draft.code === "" ? [] : [draft.code])];
  if (kind === "event" && draft.event !== "bit") return [t(`page.scope.event_${draft.event}`), whose];
  const option = draft.signal === null ? undefined : options.byName.get(draft.signal);
  const signal = option ? `${option.place} ${option.title}` : "–";
  if (kind === "event") return [t("page.scope.event_bit"), signal];
  const way = t(kind === "edge" ? `page.scope.slope_${draft.slope}` : `page.scope.side_${draft.side}`);
  return [
    signal,
    way,
    ...(option?.bit == null ? [`${number(draft.level)} ${option?.unit ?? ""}`.trim()] : []),
  ];
}
