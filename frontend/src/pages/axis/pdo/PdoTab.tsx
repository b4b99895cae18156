import { Alert, Button, SegmentedControl } from "@mantine/core";
import { IconArrowBackUp, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { commands, Problem } from "../../../api/client";
import { pdoCommands, pdoPreviewQuery, type Pdos, pdosQuery, type PdoUndo } from "../../../api/pdo";
import { jobQuery, queryClient } from "../../../api/queries";
import type { DeviceRef, StationRef } from "../../../api/types";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useRole } from "../../../frame/role";
import { usePageSearch } from "../../../frame/search";
import { useShown, useWatchDevice } from "../../../live/live";
import { PAGE } from "../../../motion/lease";
import { useTexts } from "../../../texts/texts";
import { timeOfDay } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { useDeviceContext } from "../../../ui/reading";
import room from "../../../ui/Room.module.css";
import { PMC, PMM } from "../../overview/layout";
import { ReplayLock } from "../../parameters/ReplayLock";
import axis from "../Axis.module.css";
import { BladeStrip } from "../BladeStrip";
import { nameOf, pdoEdits, usePdoEdits } from "./edits";
import { PdoBar } from "./PdoBar";
import { PdoReview } from "./PdoReview";
import { PdoRow } from "./PdoRow";
import classes from "./Pdo.module.css";

/** The PDOs of a unit of the chosen blade: what they carry, what they cost, and how both are changed. */
export function PdoTab() {
  return (
    <div className={axis.page}>
      <BladeStrip now={(station) => <Units station={station} />}>
        {(station) => <Unit key={station.slug} station={station} />}
      </BladeStrip>
    </div>
  );
}

const unitsOf = (station: StationRef) =>
  [PMC, PMM].flatMap((kind) => station.devices.filter((device) => device.description_id === kind));

/** The unit that the address names; else the one that is named like it, so that another blade shows the same one. */
function useUnit(station: StationRef): DeviceRef | undefined {
  const [{ device }] = usePageSearch();
  const units = unitsOf(station);
  const like = device?.slice(device.lastIndexOf("/"));
  return (
    units.find((one) => one.slug === device) ??
    units.find((one) => like !== undefined && one.slug.endsWith(like)) ??
    units[0]
  );
}

function Units({ station }: { station: StationRef }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const units = unitsOf(station);
  return (
    <SegmentedControl
      value={useUnit(station)?.slug ?? ""}
      onChange={(device) => update({ device, pdo: undefined })}
      data={units.map((one) => ({ value: one.slug, label: one.name }))}
      aria-label={t("page.pdo.choose")}
      data-testid="choose-unit"
    />
  );
}

function Unit({ station }: { station: StationRef }) {
  const t = useTexts();
  const unit = useUnit(station);
  const { ctx } = useShown();
  const query = useQuery({ ...pdosQuery(ctx, unit?.slug ?? ""), enabled: unit !== undefined });
  if (unit === undefined) return <p className={room.note}>{t("page.pdo.none")}</p>;
  if (query.data === undefined)
    return query.error === null ? null : <ProblemAlert error={query.error} title={t("page.pdo.failed")} />;
  return <Editor key={unit.slug} unit={unit} pdos={query.data} />;
}

/** What a job or a read has left is read anew. */
const refresh = () => queryClient.invalidateQueries({ queryKey: ["pdos"] });

function Editor({ unit, pdos }: { unit: DeviceRef; pdos: Pdos }) {
  const t = useTexts();
  const { may } = useRole();
  const { ctx, recorded } = useShown();
  const context = useDeviceContext(unit);
  useWatchDevice(unit.slug);
  const edits = usePdoEdits(unit.slug);
  const list = recorded ? [] : [...edits.values()];
  const preview = useQuery({ ...pdoPreviewQuery(unit.slug, list), enabled: list.length > 0 });
  const found = list.length > 0 ? preview.data : undefined;
  const [reviewing, setReviewing] = useState(false);
  const [jobId, setJobId] = useState<string | null>(null);
  const job = useQuery(jobQuery(jobId)).data;
  const started = (id: string) => {
    setJobId(id);
    setReviewing(true);
  };
  const apply = useMutation({
    mutationFn: () => pdoCommands.apply(unit.slug, PAGE, list),
    onSuccess: ({ id }) => started(id),
  });
  const undo = useMutation({
    mutationFn: () => pdoCommands.undo(unit.slug, PAGE),
    onSuccess: ({ id }) => started(id),
  });
  const ended = job !== undefined && job.state !== "running" ? job.state : null;
  useEffect(() => {
    if (ended === null) return;
    if (ended === "done") pdoEdits.discard(unit.slug);
    void refresh();
  }, [ended, unit.slug]);
  const close = () => {
    setReviewing(false);
    if (ended !== null || jobId === null) setJobId(null);
    apply.reset();
  };
  const locked = recorded || !may("technician");
  const ready =
    preview.isSuccess &&
    !preview.isPlaceholderData &&
    !preview.data.findings.some((one) => one.severity === "error");
  return (
    <>
      <div className={`${classes.body} bench`}>
        {recorded && <ReplayLock />}
        <Told pdos={pdos} undo={() => undo.mutate()} busy={undo.isPending} locked={recorded} />
        {undo.error !== null && <ProblemAlert error={undo.error} title={t("page.pdo.put_back_failed")} />}
        {list.length > 0 && preview.error instanceof Problem && (
          <ProblemAlert error={preview.error} title={t("page.pdo.failed")} />
        )}
        {(["rpdo", "tpdo"] as const).map((direction) => (
          <section key={direction} aria-label={t(`page.pdo.${direction}`)}>
            <h2 className={classes.direction}>{t(`page.pdo.${direction}`)}</h2>
            {pdos.pdos
              .filter((pdo) => pdo.direction === direction)
              .map((pdo) => {
                const edit = recorded ? undefined : edits.get(nameOf(pdo));
                return (
                  <PdoRow
                    key={pdo.number}
                    pdo={pdo}
                    setup={edit?.wanted ?? pdo.setup}
                    edited={edit !== undefined}
                    operational={pdos.operational === true}
                    mappable={pdos.mappable}
                    context={context}
                    findings={(found?.findings ?? []).filter(
                      (one) => one.direction === pdo.direction && one.number === pdo.number,
                    )}
                    locked={locked}
                    onChange={(wanted) => pdoEdits.want(unit.slug, pdo, wanted)}
                  />
                );
              })}
          </section>
        ))}
      </div>
      <PdoBar
        key={ctx}
        pdos={pdos}
        preview={found}
        changes={list.length}
        ready={ready}
        locked={locked}
        onDiscard={() => pdoEdits.discard(unit.slug)}
        onReview={() => setReviewing(true)}
      />
      {reviewing && (
        <PdoReview
          preview={found}
          job={job}
          starting={apply.isPending || (jobId !== null && job === undefined)}
          error={apply.error}
          device={unit.slug}
          bitrate={pdos.bitrate}
          onApply={() => apply.mutate()}
          onUndo={ended === "done" && pdos.undo?.stand === "ready" ? () => undo.mutate() : null}
          onClose={close}
        />
      )}
    </>
  );
}

interface ToldProps {
  pdos: Pdos;
  undo: () => void;
  busy: boolean;
  locked: boolean;
}

/** What is to be known before anything is changed: unread objects, the state of the node, the last change. */
function Told({ pdos, undo, busy, locked }: ToldProps) {
  const t = useTexts();
  const read = useMutation({ mutationFn: () => commands.read(pdos.device, pdos.unread), onSettled: refresh });
  const save = useMutation({ mutationFn: () => commands.save(pdos.device) });
  return (
    <>
      {pdos.unread.length > 0 && (
        <Alert color="yellow" variant="light" icon={<IconInfoCircle aria-hidden />} data-testid="pdo-unread">
          <div className={classes.told}>
            {t("page.pdo.missing")}
            <NeedsRole role="technician" device>
              {(no) => (
                <Button
                  variant="default"
                  h={40}
                  disabled={no}
                  loading={read.isPending}
                  onClick={() => read.mutate()}
                >
                  {t("page.pdo.read")}
                </Button>
              )}
            </NeedsRole>
          </div>
        </Alert>
      )}
      {pdos.operational === false && (
        <p className={classes.note} data-testid="pdo-not-operational">
          <IconInfoCircle size={17} aria-hidden /> {t("page.pdo.not_operational")}
        </p>
      )}
      {pdos.undo !== null && !locked && (
        <Alert
          color={pdos.undo.stand === "open" ? "red" : "blue"}
          variant="light"
          icon={<IconArrowBackUp aria-hidden />}
          data-testid={`pdo-undo-${pdos.undo.stand}`}
        >
          <div className={classes.told}>
            <span>
              {undoText(pdos.undo, t)} {t(pdos.keeps ? "page.pdo.kept" : "page.pdo.after_restart")}
            </span>
            {pdos.keeps && (
              <NeedsRole role="technician" device>
                {(no) => (
                  <Button
                    variant="default"
                    h={40}
                    disabled={no}
                    loading={save.isPending}
                    onClick={() => save.mutate()}
                  >
                    {t("page.pdo.save")}
                  </Button>
                )}
              </NeedsRole>
            )}
            {(pdos.undo.stand === "ready" || pdos.undo.stand === "open") && (
              <NeedsRole role="technician" device>
                {(no) => (
                  <Button
                    variant="default"
                    h={40}
                    disabled={no}
                    loading={busy}
                    onClick={undo}
                    data-testid="pdo-undo"
                  >
                    {t("page.pdo.put_back")}
                  </Button>
                )}
              </NeedsRole>
            )}
          </div>
        </Alert>
      )}
    </>
  );
}

function undoText(undo: PdoUndo, t: ReturnType<typeof useTexts>): string {
  const { person, pdos, stand, t_ns } = undo;
  return t(`page.pdo.undo_${stand}`, { person, pdos: pdos.join(", "), time: timeOfDay(t_ns / 1e6, 0) });
}
