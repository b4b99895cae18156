import { ActionIcon, Button, TextInput } from "@mantine/core";
import { IconPlus, IconSearch, IconX } from "@tabler/icons-react";
import { useDeferredValue, useMemo, useState } from "react";
import type { SignalRate } from "../../../api/scope";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { MAX_SIGNALS } from "./draft";
import { found, type Options, PRESET_NAMES, presetOf } from "./options";
import classes from "./Scope.module.css";
import { Swatch } from "./Swatch";
import { COLOURS } from "./traces";

const MOST = 40;

interface Props {
  options: Options;
  /** Full names. */
  chosen: readonly string[];
  /** Of the signals that are armed. */
  rates: readonly SignalRate[];
  /** `wtg-07/blade-1`: what presets are about. */
  station: string | null;
  locked: boolean;
  onChosen: (names: readonly string[]) => void;
}

/** Which signals are shown, how each comes, and all that could be shown. */
export function SignalsPanel({ options, chosen, rates, station, locked, onChosen }: Props) {
  const t = useTexts();
  const byName = new Map(rates.map((one) => [one.name, one]));
  return (
    <div className={classes.panel}>
      <h2>{t("page.scope.presets")}</h2>
      <div className={classes.presets}>
        {PRESET_NAMES.map((preset) => (
          <Button
            key={preset}
            variant="default"
            disabled={locked || station === null || presetOf(preset, station, options).length === 0}
            onClick={() => station !== null && onChosen(presetOf(preset, station, options))}
            data-testid={`preset-${preset}`}
          >
            {t(`page.scope.preset_${preset}`)}
          </Button>
        ))}
      </div>
      <h2>{t("page.scope.chosen", { count: chosen.length, limit: MAX_SIGNALS })}</h2>
      {chosen.length === 0 && <p className={classes.told}>{t("page.scope.chosen_none")}</p>}
      <ul className={classes.chosen} data-testid="chosen-signals">
        {chosen.map((name, at) => {
          const option = options.byName.get(name);
          const label = option ? `${option.place} ${option.title}` : name;
          return (
            <li key={name} data-testid={`chosen-${name}`}>
              <Swatch colour={at % COLOURS} dash={[]} />
              <span>
                {label}
                {option && option.unit !== "" ? `, ${option.unit}` : ""}
                <small className="dim">{wayOf(byName.get(name), t)}</small>
              </span>
              <ActionIcon
                variant="subtle"
                size={40}
                disabled={locked}
                aria-label={t("page.scope.remove", { signal: label })}
                onClick={() => onChosen(chosen.filter((one) => one !== name))}
              >
                <IconX size={17} aria-hidden />
              </ActionIcon>
            </li>
          );
        })}
      </ul>
      {!locked && <Search options={options} chosen={chosen} onChosen={onChosen} />}
    </div>
  );
}

function wayOf(rate: SignalRate | undefined, t: Translate): string {
  if (!rate) return t("page.scope.way_unarmed");
  return t(`page.scope.way_${rate.way}`, { rate: localise(rate.rate_hz.toFixed(1), t.language) });
}

function Search({ options, chosen, onChosen }: Pick<Props, "options" | "chosen" | "onChosen">) {
  const t = useTexts();
  const [typed, setTyped] = useState("");
  const words = useDeferredValue(typed);
  const hits = useMemo(() => found(options.all, words), [options, words]);
  const full = chosen.length >= MAX_SIGNALS;
  const taken = new Set(chosen);
  const shown = hits.filter(({ name }) => !taken.has(name)).slice(0, MOST);
  const more =
    hits.length - shown.length - chosen.filter((name) => hits.some((one) => one.name === name)).length;
  return (
    <>
      <TextInput
        label={t("page.scope.search")}
        leftSection={<IconSearch size={17} aria-hidden />}
        value={typed}
        onChange={(event) => setTyped(event.currentTarget.value)}
        data-testid="find-signal"
      />
      {full && <p className={classes.told}>{t("page.scope.full")}</p>}
      <ul className={classes.hits} aria-label={t("page.scope.hits")} data-testid="signal-hits">
        {shown.map((one) => (
          <li key={one.name}>
            <button
              type="button"
              disabled={full}
              onClick={() => onChosen([...chosen, one.name])}
              data-testid={`add-${one.name}`}
            >
              <IconPlus size={16} aria-hidden />
              <span>
                {one.title}
                <small className="dim">
                  {one.place}, {one.address}
                  {one.bit === null ? "" : `.${one.bit}`}
                  {one.unit === "" ? "" : `, ${one.unit}`}
                </small>
              </span>
            </button>
          </li>
        ))}
      </ul>
      {shown.length === 0 && <p className={classes.told}>{t("page.scope.found_none")}</p>}
      {more > 0 && <p className={classes.told}>{t("page.scope.found_more", { count: more })}</p>}
    </>
  );
}
