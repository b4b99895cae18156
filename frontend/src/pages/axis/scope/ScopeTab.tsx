import { SegmentedControl, Tabs } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useEffect, useRef, useState } from "react";
import { useTurbineQuery } from "../../../api/queries";
import { capturesQuery, isArmed, scopeQuery, type ScopeLine } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { useRole } from "../../../frame/role";
import { useTexts } from "../../../texts/texts";
import { stationName } from "../../../ui/devices";
import room from "../../../ui/Room.module.css";
import { useTyped } from "../../../ui/useTyped";
import { hasAxis, keyOf } from "../stations";
import { CapturesPanel } from "./CapturesPanel";
import { CaptureView } from "./CaptureView";
import { type Draft, draftOf, FIRST } from "./draft";
import { draftOfText, draftText } from "./draftText";
import { LiveView } from "./LiveView";
import { type Options, useOptions } from "./options";
import classes from "./Scope.module.css";
import { ScopeControl } from "./ScopeControl";
import { type Side, Start } from "./Start";
import { SignalsPanel } from "./SignalsPanel";
import { TriggerPanel } from "./TriggerPanel";
import { listOf } from "./view";

/** The oscilloscope: signals, trigger and captures on the left, what is seen on the right. */
export function ScopeTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const turbine = useQuery(useTurbineQuery()).data;
  const replayed = search.replay !== undefined;
  const now = useQuery({ ...scopeQuery, enabled: !replayed }).data;
  const line = replayed ? undefined : now; // what the bench measures now is not what was recorded
  const captures = useQuery(capturesQuery).data ?? [];
  const options = useOptions(search.blade);
  const role = useRole();
  const stations = (turbine?.stations ?? []).filter(hasAxis);
  const station = stations.find((one) => keyOf(one) === search.blade) ?? stations[0];
  const [text, setText] = useTyped(search.trigger ?? "", (typed) => update({ trigger: typed }));
  const draft = draftOfText(text || undefined, turbine?.slug) ?? (line?.order ? draftOf(line.order) : FIRST);
  const setDraft = (change: Partial<Draft>) =>
    setText(draftText(withSignal({ ...draft, ...change }, chosen, options)));
  const [side, setSide] = useState<Side>(replayed ? "captures" : "signals");
  const locked = replayed || !role.may("technician") || turbine === undefined;
  const chosen = chosenOf(search.channels, line?.order?.signals, turbine?.slug);
  const references = listOf(search.refs);
  useNewest(line?.captures, (capture) => update({ capture, zoom: undefined }));
  const choose = (names: readonly string[]) => update({ channels: channelsText(names) });
  return (
    <div className={classes.scope}>
      <div className={room.strip}>
        <h1>{t("page.scope.title")}</h1>
        {station && (
          <SegmentedControl
            value={keyOf(station)}
            onChange={(blade) => update({ blade })}
            data={stations.map((one) => ({ value: keyOf(one), label: stationName(one, t) }))}
            aria-label={t(station.blade === null ? "page.axis.choose_axis" : "page.axis.choose")}
            data-testid="choose-blade"
          />
        )}
        <ScopeControl
          line={line}
          draft={draft}
          chosen={chosen}
          replayed={replayed}
          why={role.why("technician")}
          locked={locked}
          onArmed={() => {
            // The link tells all of it from now on: elsewhere something else may have been armed last.
            const setup = { channels: channelsText(chosen), trigger: draftText(draft) };
            update({ ...setup, capture: undefined, zoom: undefined, cursors: undefined });
          }}
        />
      </div>
      <div className={classes.columns}>
        <aside className={classes.side} aria-label={t("page.scope.side")}>
          <Tabs value={side} onChange={(next) => next !== null && setSide(next as Side)}>
            <Tabs.List grow>
              {(["signals", "trigger", "captures"] as const).map((one) => (
                <Tabs.Tab key={one} value={one} h={40} px={4} data-testid={`scope-side-${one}`}>
                  {t(`page.scope.tab_${one}`)}
                </Tabs.Tab>
              ))}
            </Tabs.List>
            <Tabs.Panel value="signals">
              <SignalsPanel
                options={options}
                chosen={chosen}
                rates={isArmed(line) ? (line?.signals ?? []) : []}
                station={station?.slug ?? null}
                locked={locked}
                onChosen={choose}
              />
            </Tabs.Panel>
            <Tabs.Panel value="trigger">
              <TriggerPanel {...{ draft, options, chosen, locked }} onChange={setDraft} />
            </Tabs.Panel>
            <Tabs.Panel value="captures">
              <CapturesPanel
                captures={captures}
                open={search.capture}
                references={references}
                onOpen={(capture) => update({ capture, zoom: undefined, cursors: undefined })}
                onReferences={(ids) => update({ refs: ids.length === 0 ? undefined : ids.join() })}
              />
            </Tabs.Panel>
          </Tabs>
        </aside>
        <section className={classes.main} aria-label={t("page.scope.shown")}>
          {search.capture === undefined ? (
            <Present line={line} replayed={replayed}>
              <Start {...{ draft, options, chosen, locked, captures }} onSide={setSide} />
            </Present>
          ) : (
            <CaptureView key={search.capture} id={search.capture} captures={captures} armed={isArmed(line)} />
          )}
        </section>
      </div>
    </div>
  );
}

interface PresentProps {
  line: ScopeLine | undefined;
  replayed: boolean;
  /** What is shown before anything was measured. */
  children: ReactNode;
}

function Present({ line, replayed, children }: PresentProps) {
  const t = useTexts();
  if (!replayed) return <LiveView line={line}>{children}</LiveView>;
  return (
    <p className={classes.empty} data-testid="scope-replayed">
      {t("page.scope.empty_replay")}
    </p>
  );
}

const NONE = "none";

const channelsText = (names: readonly string[]) =>
  names.length === 0 ? NONE : names.map((name) => name.slice(name.indexOf("/") + 1)).join();

/** As the URL names them; where it names none, those that were armed last. */
function chosenOf(
  channels: string | undefined,
  armed: readonly string[] | undefined,
  turbine: string | undefined,
): readonly string[] {
  if (channels === undefined) return armed ?? [];
  if (channels === NONE || turbine === undefined) return [];
  return listOf(channels).map((name) => `${turbine}/${name}`);
}

/** Where a trigger needs a signal and has none yet, it is the first one that fits. */
function withSignal(draft: Draft, chosen: readonly string[], options: Options): Draft {
  const bits = draft.kind === "event" && draft.event === "bit";
  if (draft.kind !== "edge" && draft.kind !== "level" && !bits) return draft;
  const fits = (name: string) => !bits || options.byName.get(name)?.bit != null;
  if (draft.signal !== null && fits(draft.signal)) return draft;
  return { ...draft, signal: chosen.find(fits) ?? null };
}

/** Shows a capture as it comes; those that were there before are opened by hand. */
function useNewest(ids: readonly string[] | undefined, show: (id: string) => void): void {
  const known = useRef<string | undefined | null>(null);
  const asked = ids !== undefined;
  const newest = ids?.at(-1);
  const latest = useRef(show);
  useEffect(() => {
    latest.current = show;
  });
  useEffect(() => {
    if (!asked) return;
    if (known.current !== null && newest !== undefined && newest !== known.current) latest.current(newest);
    known.current = newest;
  }, [asked, newest]);
}
