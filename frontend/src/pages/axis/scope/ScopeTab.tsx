import { SegmentedControl, Tabs } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { useTurbineQuery } from "../../../api/queries";
import { capturesQuery, isArmed, scopeQuery, type ScopeLine } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { useRole } from "../../../frame/role";
import { useTexts } from "../../../texts/texts";
import { stationName } from "../../../ui/devices";
import room from "../../../ui/Room.module.css";
import { CapturesPanel } from "./CapturesPanel";
import { CaptureView } from "./CaptureView";
import { type Draft, draftOf, FIRST } from "./draft";
import { LiveView } from "./LiveView";
import { useOptions } from "./options";
import classes from "./Scope.module.css";
import { ScopeControl } from "./ScopeControl";
import { SignalsPanel } from "./SignalsPanel";
import { TriggerPanel } from "./TriggerPanel";
import { listOf } from "./view";

type Side = "signals" | "trigger" | "captures";

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
  const stations = (turbine?.stations ?? []).filter((one) => one.blade !== null);
  const station = stations.find((one) => String(one.blade) === search.blade) ?? stations[0];
  const [draft, setDraft] = useDraft(line?.order);
  const [side, setSide] = useState<Side>(search.replay === undefined ? "signals" : "captures");
  const locked = replayed || !role.may("technician") || turbine === undefined;
  const chosen = chosenOf(search.channels, line?.order?.signals, turbine?.slug);
  const references = listOf(search.refs);
  useNewest(line?.captures ?? [], (capture) => update({ capture, zoom: undefined }));
  const choose = (names: readonly string[]) =>
    update({
      channels: names.length === 0 ? NONE : names.map((name) => name.slice(name.indexOf("/") + 1)).join(),
    });
  return (
    <div className={classes.scope}>
      <div className={room.strip}>
        <h1>{t("page.scope.title")}</h1>
        {station && (
          <SegmentedControl
            value={String(station.blade)}
            onChange={(blade) => update({ blade })}
            data={stations.map((one) => ({ value: String(one.blade), label: stationName(one, t) }))}
            aria-label={t("page.axis.choose")}
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
          onArmed={() => update({ capture: undefined, zoom: undefined, cursors: undefined })}
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
            <Present line={line} replayed={replayed} />
          ) : (
            <CaptureView key={search.capture} id={search.capture} captures={captures} armed={isArmed(line)} />
          )}
        </section>
      </div>
    </div>
  );
}

function Present({ line, replayed }: { line: ScopeLine | undefined; replayed: boolean }) {
  const t = useTexts();
  if (!replayed) return <LiveView line={line} />;
  return (
    <p className={classes.empty} data-testid="scope-replayed">
      {t("page.scope.empty_replay")}
    </p>
  );
}

const NONE = "none";

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

/** What is typed; it begins with what was armed last, as soon as that is known. */
function useDraft(
  order: Parameters<typeof draftOf>[0] | null | undefined,
): [Draft, (change: Partial<Draft>) => void] {
  const [typed, setTyped] = useState<Draft | null>(null);
  const draft = typed ?? (order ? draftOf(order) : FIRST);
  return [draft, (change) => setTyped({ ...draft, ...change })];
}

/** Shows a capture as it comes; those that were there before are opened by hand. */
function useNewest(ids: readonly string[], show: (id: string) => void): void {
  const known = useRef<string | undefined | null>(null);
  const newest = ids.at(-1);
  const latest = useRef(show);
  useEffect(() => {
    latest.current = show;
  });
  useEffect(() => {
    if (known.current !== null && newest !== undefined && newest !== known.current) latest.current(newest);
    known.current = newest;
  }, [newest]);
}
