import { ActionIcon, Alert, Button, Checkbox, Group, SegmentedControl, Stack, Text } from "@mantine/core";
import { IconArrowRight, IconTrash } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useContext, useMemo, useState } from "react";
import { sessionQuery } from "../../api/queries";
import { type WritesPlan, writesPlanQuery } from "../../api/writes";
import type { Raw, WritesRequest } from "../../api/types";
import { useDeviceVersion, useWatchDevice } from "../../live/live";
import { asks, FindingKind, planOf, type PlannedRow, stops } from "../../model/findings";
import { titleOf } from "../../model/rows";
import { pendingOf, touching } from "../../model/ruleFindings";
import { categoryName, savesFor } from "../../model/saving";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import { type Change, keyOf } from "../../model/staged";
import { type Translate, useTexts } from "../../texts/texts";
import { type Place, useDeviceName } from "../../ui/devices";
import { HoldButton } from "../../ui/HoldButton";
import { useContexts } from "./devicesOf";
import { FindingList } from "./FindingList";
import { ReviewAddress } from "./ReviewAddress";
import { ReviewOrder } from "./ReviewOrder";
import { RuleFindingList } from "./RuleFindingList";
import { JudgedContext } from "./rules";
import classes from "./Parameters.module.css";
import { entriesOf, groundOf, plannedContext, staged, useStaged } from "./staging";
import { useSilent } from "./silent";
import { useOpenParameter } from "./useOpenParameter";
import { reasonOf } from "./ValueCell";
import { useWrite } from "./writing";

interface DevicePlan {
  slug: string;
  context: DeviceContext | undefined;
  rows: PlannedRow[];
}

/** Everything that is pending, device by device in the order in which it will be written. */
export function ReviewList({ places, onClose }: { places: readonly Place[]; onClose: () => void }) {
  const t = useTexts();
  const [accepted, setAccepted] = useState(false);
  const [addressOf, setAddressOf] = useState("");
  const planned = usePlans(places);
  const order = useQuery(
    writesPlanQuery(
      planned.flatMap((plan) => plan.rows.map((row) => row.change)),
      accepted,
    ),
  );
  const turns = useMemo(() => turnsOf(order.data), [order.data]);
  const plans = planned.map((plan) => ({ ...plan, rows: inTurn(plan.rows, turns) }));
  const write = useWrite();
  const [noSave, setNoSave] = useState<ReadonlySet<string>>(new Set());
  const [onFailure, setOnFailure] = useState<WritesRequest["on_failure"]>("stop");
  const rows = plans.flatMap((plan) => plan.rows);
  const stopped = rows.filter(stops).length + plans.filter((one) => !one.context).length;
  const asked = rows.filter(asks).length;
  const unordered = (order.data?.unordered.length ?? 0) > 0;
  const save = plans.filter((one) => !noSave.has(one.slug)).map((one) => one.slug);
  const toggleSave = (slug: string) => {
    const next = new Set(noSave);
    if (!next.delete(slug)) next.add(slug);
    setNoSave(next);
  };
  // What was confirmed is this change of the address, not the next one.
  const moved = order.data?.address_changes ?? [];
  const moving = JSON.stringify(moved);
  const addressConfirmed = moved.length === 0 || addressOf === moving;
  if (rows.length === 0) return <Nothing onClose={onClose} />;
  return (
    <Stack gap="md">
      <Text size="sm" className="dim">
        {t("page.review.explain")}
      </Text>
      {plans.map((plan) => (
        <DeviceBlock
          key={plan.slug}
          plan={plan}
          turns={turns}
          save={!noSave.has(plan.slug)}
          onSave={() => toggleSave(plan.slug)}
        />
      ))}
      <Group gap="sm">
        <Text size="sm">{t("page.review.on_failure")}</Text>
        <SegmentedControl
          aria-label={t("page.review.on_failure")}
          data={[
            { value: "stop", label: t("page.review.stop") },
            { value: "go-on", label: t("page.review.go_on") },
          ]}
          value={onFailure}
          onChange={(picked) => setOnFailure(picked === "go-on" ? "go-on" : "stop")}
          data-testid="on-failure"
        />
      </Group>
      <RulesOfReview />
      <ReviewOrder plan={order.data} accepted={accepted} onAccept={setAccepted} />
      <ReviewAddress
        changes={moved}
        confirmed={addressConfirmed}
        onConfirm={(confirmed) => setAddressOf(confirmed ? moving : "")}
      />
      <Blocked stopped={stopped} asked={asked} />
      <Group justify="space-between">
        <Button
          variant="subtle"
          leftSection={<IconTrash size={17} aria-hidden />}
          onClick={() => staged.drop(rows.map(({ change }) => keyOf(change.device, change.address)))}
          data-testid="drop-all"
        >
          {t("page.review.drop_all")}
        </Button>
        <Group>
          <Button variant="default" onClick={onClose} data-autofocus>
            {t("page.review.back")}
          </Button>
          <HoldButton
            tone="accent"
            hint={t("page.hold")}
            disabled={stopped > 0 || asked > 0 || unordered || !addressConfirmed || write.isPending}
            onHeld={() =>
              write.mutate({
                changes: rows.map((row) => row.change),
                save,
                onFailure,
                accepted,
                addressConfirmed: moved.length > 0 && addressConfirmed,
              })
            }
            testId="write-hold"
          >
            {t("page.review.write", { count: rows.length, devices: plans.length })}
          </HoldButton>
        </Group>
      </Group>
    </Stack>
  );
}

/** The turn of each row in the whole batch, from 1. */
type Turns = ReadonlyMap<string, number>;

const turnsOf = (plan: WritesPlan | undefined): Turns =>
  new Map((plan?.rows ?? []).map(({ device, address }, at) => [keyOf(device, address), at + 1]));

const turnOf = ({ change }: PlannedRow, turns: Turns): number =>
  turns.get(keyOf(change.device, change.address)) ?? Infinity;

/** Rows by their turns; those that have none keep their places at the end. */
const inTurn = (rows: readonly PlannedRow[], turns: Turns): PlannedRow[] =>
  rows.toSorted((a, b) => {
    const [first, second] = [turnOf(a, turns), turnOf(b, turns)];
    return first === second ? 0 : first - second;
  });

function usePlans(places: readonly Place[]): DevicePlan[] {
  const { changes } = useStaged();
  const role = useQuery(sessionQuery).data?.role ?? "viewer";
  const contexts = useContexts(places);
  const bySlug = new Map<string, Change[]>();
  for (const change of changes.values())
    bySlug.set(change.device, [...(bySlug.get(change.device) ?? []), change]);
  const order = places.map((place) => place.device.slug);
  const slugs = [...bySlug.keys()].sort((a, b) => order.indexOf(a) - order.indexOf(b));
  return slugs.map((slug) => {
    const list = bySlug.get(slug) ?? [];
    const context = contexts.get(slug);
    const rows = context
      ? planOf(list, groundOf(context, role))
      : list.map((change) => ({ change, findings: [] }));
    return { slug, context, rows };
  });
}

/** What the rules find at the pending objects once all of them were written. It forbids nothing: a person decides. */
function RulesOfReview() {
  const t = useTexts();
  const open = useOpenParameter();
  const { changes } = useStaged();
  const { stations } = useContext(JudgedContext);
  const findings = touching(
    stations.flatMap((one) => one.findings),
    pendingOf(changes.values()),
  );
  if (findings.length === 0) return null;
  return (
    <section data-testid="review-rules">
      <Text size="sm" fw={650} mb={6}>
        {t("page.rules.review", { count: findings.length })}
      </Text>
      <RuleFindingList findings={findings} onJump={open} />
    </section>
  );
}

function Nothing({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  return (
    <Stack>
      <Text>{t("page.review.nothing")}</Text>
      <Group justify="flex-end">
        <Button variant="default" onClick={onClose}>
          {t("page.close")}
        </Button>
      </Group>
    </Stack>
  );
}

function Blocked({ stopped, asked }: { stopped: number; asked: number }) {
  const t = useTexts();
  if (stopped === 0 && asked === 0) return null;
  return (
    <Alert color={stopped > 0 ? "red" : "orange"} variant="light" p="sm" data-testid="review-blocked">
      {stopped > 0 && <div>{t("page.review.stopped", { count: stopped })}</div>}
      {asked > 0 && <div>{t("page.review.asked", { count: asked })}</div>}
    </Alert>
  );
}

interface BlockProps {
  plan: DevicePlan;
  turns: Turns;
  save: boolean;
  onSave: () => void;
}

function DeviceBlock({ plan, turns, save, onSave }: BlockProps) {
  const t = useTexts();
  const name = useDeviceName()(plan.slug);
  const silent = useSilent(plan.slug);
  // What RAM holds is compared as it changes, also of devices that the table does not show.
  useWatchDevice(plan.slug);
  useDeviceVersion(plan.slug);
  return (
    <section className={classes.reviewDevice} data-testid={`review-${plan.slug}`}>
      <header>
        <h3>{name}</h3>
        <span className="dim">{t("page.review.rows", { count: plan.rows.length })}</span>
        <Checkbox
          label={saveLabel(plan, t)}
          checked={save}
          onChange={onSave}
          data-testid={`save-after-${plan.slug}`}
        />
      </header>
      {silent && (
        <Alert color="orange" p="xs">
          {t("page.write.silent")}
        </Alert>
      )}
      <ol>
        {plan.rows.map((row) => (
          <ReviewRow key={row.change.address} row={row} turn={turnOf(row, turns)} context={plan.context} />
        ))}
      </ol>
    </section>
  );
}

/** The categories that are saved are named, where the device has some. */
function saveLabel({ context, rows }: DevicePlan, t: Translate): string {
  const saves = context
    ? savesFor(
        context.doc,
        rows.map((row) => row.change.address),
      )
    : [];
  const parts = saves.filter((one) => one !== null).map((one) => categoryName(one, t));
  if (parts.length === 0) return t("page.review.save_after");
  return t("page.saving.after", { categories: parts.join(", ") });
}

interface RowProps {
  row: PlannedRow;
  turn: number;
  context: DeviceContext | undefined;
}

function ReviewRow({ row, turn, context }: RowProps) {
  const t = useTexts();
  const { change, findings } = row;
  const key = keyOf(change.device, change.address);
  const entry = context && entriesOf(context.doc).get(change.address);
  if (!context || !entry) {
    return (
      <li className={classes.reviewRow}>
        {change.address} {t("page.review.gone")}
      </li>
    );
  }
  const line = (raw: Raw | null, of: DeviceContext) => (raw === null ? "–" : lineOf(shownOf(entry, raw, of)));
  const conflict = findings.find((one) => one.kind === FindingKind.Conflict);
  return (
    <li className={classes.reviewRow} data-testid={`review-row-${change.address}`}>
      <div className={classes.reviewLine}>
        <span
          className={classes.turn}
          title={t("page.review.order.turn")}
          data-testid={`turn-${change.address}`}
        >
          {Number.isFinite(turn) ? `${turn}.` : "–"}
        </span>
        <span className={classes.address}>{change.address}</span>
        <span className={classes.reviewName}>{titleOf(entry, t)}</span>
        <span className={classes.reviewValues}>
          <s>{line(context.lookup(change.address), context)}</s>
          <IconArrowRight size={15} aria-hidden />
          <b>{line(change.raw, plannedContext(context))}</b>
        </span>
        <ActionIcon
          variant="subtle"
          aria-label={t("page.review.drop", { name: titleOf(entry, t) })}
          onClick={() => staged.drop([key])}
          data-testid={`drop-${change.address}`}
        >
          <IconTrash size={17} aria-hidden />
        </ActionIcon>
      </div>
      <FindingList findings={findings} entry={entry} device={context} />
      {change.refused && (
        <p className={classes.refusedBefore}>
          ✕ {t("page.review.refused_before", { reason: reasonOf(change.refused, t) })}
        </p>
      )}
      {conflict && (
        <Button
          variant="default"
          onClick={() => staged.confirm(key, conflict.details.found as Raw)}
          data-testid={`confirm-${change.address}`}
        >
          {t("page.review.confirm")}
        </Button>
      )}
    </li>
  );
}
