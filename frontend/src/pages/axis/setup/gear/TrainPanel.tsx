import { Button, Select, TextInput } from "@mantine/core";
import { IconPencilCheck, IconPlus, IconTrash } from "@tabler/icons-react";
import { useState } from "react";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { usePageSearch } from "../../../../frame/search";
import { useShown } from "../../../../live/live";
import {
  factsOf,
  MOST_STAGES,
  readTrain,
  scalingOf,
  type Stage,
  type Train,
  trainText,
  wholeScaling,
} from "../../../../model/gear";
import { fraction, toNumber } from "../../../../model/decimal";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { useTyped } from "../../../../ui/useTyped";
import { stage as stageValue, useStaged, staged } from "../../../parameters/staging";
import axis from "../../Axis.module.css";
import classes from "./Gear.module.css";
import { Numbers } from "./Numbers";
import { entryAt, isNegative, POLARITIES, roomsOf, rowsOf, type Side, trainOf } from "./sides";
import { BladeShape, Disc, Motor, Wheels } from "./Wheels";

/** One encoder with its gears: drawn, typed, and as the exact fractions that the drive would hold. */
export function TrainPanel({ pmc, side }: { pmc: DeviceContext; side: Side }) {
  const t = useTexts();
  const { recorded } = useShown();
  const [search, update] = usePageSearch();
  const key = side.name === "motor" ? "gear" : "ae";
  const [text, setText] = useTyped(search[key] ?? "", (typed) =>
    update({ [key]: typed === "" ? undefined : typed }),
  );
  const read = readTrain(text);
  const train = recorded || read === null ? trainOf(pmc, side) : read;
  const parts = scalingOf(train, roomsOf(pmc, side));
  const whole = wholeScaling(parts);
  const change = (next: Partial<Train>) => setText(trainText({ ...train, ...next }));
  const title = t(`page.setup.gear.${side.name}`);
  return (
    <section className={`${axis.panel} ${axis.wide}`} aria-label={title} data-testid={`train-${side.name}`}>
      <h2>{title}</h2>
      <Drawing train={train} side={side} locked={recorded} onChange={change} />
      <p className="dim">{t("page.setup.gear.stages_note")}</p>
      {recorded && whole === null && (
        <p className="dim" data-testid={`not-recorded-${side.name}`}>
          {t("page.axis.recorded.unknown")}
        </p>
      )}
      {Object.entries(parts).map(
        ([name, part]) =>
          !recorded &&
          !part.ok && (
            <p key={name} className={classes.bad} role="alert" data-testid={`fault-${side.name}-${name}`}>
              {t(`page.setup.gear.part.${name}`)}: {t(`page.setup.gear.fault.${part.fault}`)}
            </p>
          ),
      )}
      {whole !== null && <Numbers pmc={pmc} side={side} scaling={whole} facts={factsOf(whole)} />}
      {!recorded && (
        <div className={classes.row}>
          <Polarity pmc={pmc} side={side} />
          <NeedsRole role="technician" device>
            {(locked) => (
              <StageButton
                pmc={pmc}
                rows={whole === null ? [] : rowsOf(side, whole)}
                side={side}
                locked={locked}
              />
            )}
          </NeedsRole>
          {text !== "" && (
            <Button
              variant="subtle"
              px="sm"
              onClick={() => setText("")}
              data-testid={`from-drive-${side.name}`}
            >
              {t("page.setup.gear.from_drive")}
            </Button>
          )}
        </div>
      )}
    </section>
  );
}

interface DrawingProps {
  train: Train;
  side: Side;
  locked: boolean;
  onChange: (change: Partial<Train>) => void;
}

function Drawing({ train, side, locked, onChange }: DrawingProps) {
  const t = useTexts();
  const { stages } = train;
  const put = (at: number, change: Partial<Stage>) =>
    onChange({ stages: stages.map((one, place) => (place === at ? { ...one, ...change } : one)) });
  return (
    <ol className={classes.train}>
      <li>
        <div className={classes.part}>
          <Disc />
          {t("page.setup.gear.encoder")}
          <div className={classes.pair}>
            <Field
              label={t("page.setup.gear.increments")}
              value={train.increments}
              locked={locked}
              onChange={(increments) => onChange({ increments })}
              testId={`increments-${side.name}`}
            />
            <Field
              label={t("page.setup.gear.turns")}
              value={train.turns}
              locked={locked}
              onChange={(turns) => onChange({ turns })}
              testId={`turns-${side.name}`}
            />
          </div>
        </div>
      </li>
      {side.name === "motor" && (
        <li>
          <div className={classes.part}>
            <Motor />
            {t("page.setup.gear.motor_shaft")}
          </div>
        </li>
      )}
      {stages.map((one, at) => (
        // A stage has no name but its place.
        <li key={at}>
          <div className={classes.part} data-testid={`stage-${side.name}-${at + 1}`}>
            <Wheels driving={size(one.driving)} driven={size(one.driven)} />
            {t("page.setup.gear.stage", { number: at + 1 })}
            <div className={classes.pair}>
              <Field
                label={t("page.setup.gear.driving")}
                value={one.driving}
                locked={locked}
                onChange={(driving) => put(at, { driving })}
                testId={`driving-${side.name}-${at + 1}`}
              />
              <Field
                label={t("page.setup.gear.driven")}
                value={one.driven}
                locked={locked}
                onChange={(driven) => put(at, { driven })}
                testId={`driven-${side.name}-${at + 1}`}
              />
            </div>
            {!locked && (
              <Button
                variant="subtle"
                px="xs"
                leftSection={<IconTrash size={16} aria-hidden />}
                onClick={() => onChange({ stages: stages.filter((_, place) => place !== at) })}
                aria-label={t("page.setup.gear.remove_stage", { number: at + 1 })}
                data-testid={`remove-${side.name}-${at + 1}`}
              >
                {t("page.setup.gear.remove")}
              </Button>
            )}
          </div>
        </li>
      ))}
      {!locked && stages.length < MOST_STAGES && (
        <li>
          <Button
            variant="default"
            leftSection={<IconPlus size={16} aria-hidden />}
            onClick={() => onChange({ stages: [...stages, { driving: "1", driven: "1" }] })}
            data-testid={`add-${side.name}`}
          >
            {t("page.setup.gear.add")}
          </Button>
        </li>
      )}
      <li>
        <div className={classes.part}>
          <BladeShape />
          {t("page.setup.gear.blade_turn")}
          <div className={classes.pair}>
            <Field
              label={t("page.setup.gear.feed")}
              value={train.feed}
              locked={locked}
              onChange={(feed) => onChange({ feed })}
              testId={`feed-${side.name}`}
            />
            <Field
              label={t("page.setup.gear.feed_turns")}
              value={train.feedTurns}
              locked={locked}
              onChange={(feedTurns) => onChange({ feedTurns })}
              testId={`feed-turns-${side.name}`}
            />
          </div>
        </div>
      </li>
    </ol>
  );
}

const size = (text: string): number => {
  const found = fraction(text);
  return found === null ? 1 : Math.max(1, toNumber(found));
};

interface FieldProps {
  label: string;
  value: string;
  locked: boolean;
  onChange: (text: string) => void;
  testId: string;
}

const UNWANTED = /[^\d.,]/g;

function Field({ label, value, locked, onChange, testId }: FieldProps) {
  return (
    <TextInput
      label={label}
      value={value}
      onChange={(event) => onChange(event.currentTarget.value.replace(UNWANTED, ""))}
      readOnly={locked}
      inputMode="decimal"
      w={78}
      size="sm"
      maxLength={12}
      data-testid={testId}
    />
  );
}

/** Which way the position counts. */
function Polarity({ pmc, side }: { pmc: DeviceContext; side: Side }) {
  const t = useTexts();
  const { changes } = useStaged();
  const entry = entryAt(pmc, side.polarity);
  if (!entry) return null;
  const raw = changes.get(`${pmc.slug} ${side.polarity}`)?.raw ?? pmc.lookup(side.polarity);
  const negative = isNegative(raw);
  return (
    <NeedsRole role="technician" device>
      {(locked) => (
        <Select
          label={t("page.setup.gear.polarity", { address: side.polarity })}
          data={[
            { value: "positive", label: t("page.setup.gear.positive") },
            { value: "negative", label: t("page.setup.gear.negative") },
          ]}
          value={negative === null ? null : negative ? "negative" : "positive"}
          onChange={(value) => value !== null && stageValue(entry, POLARITIES[value], [pmc])}
          disabled={locked}
          allowDeselect={false}
          w={210}
          data-testid={`polarity-${side.name}`}
        />
      )}
    </NeedsRole>
  );
}

interface StageButtonProps {
  pmc: DeviceContext;
  side: Side;
  rows: readonly [string, number][];
  locked: boolean;
}

/** Puts what differs from the drive among the pending changes. */
function StageButton({ pmc, side, rows, locked }: StageButtonProps) {
  const t = useTexts();
  useStaged();
  const [done, setDone] = useState(false);
  const open = rows.filter(
    ([address, raw]) => (staged.get(pmc.slug, address)?.raw ?? pmc.lookup(address)) !== raw,
  );
  const put = () => {
    for (const [address, raw] of rows) {
      const entry = entryAt(pmc, address);
      if (entry) stageValue(entry, raw, [pmc]);
    }
    setDone(true);
  };
  return (
    <>
      <Button
        leftSection={<IconPencilCheck size={17} aria-hidden />}
        disabled={locked || open.length === 0}
        onClick={put}
        data-testid={`stage-train-${side.name}`}
      >
        {t("page.setup.gear.stage_values", { count: open.length })}
      </Button>
      <span role="status" className="dim">
        {open.length === 0 && rows.length > 0 && t(done ? "page.setup.gear.staged" : "page.setup.gear.same")}
      </span>
    </>
  );
}
