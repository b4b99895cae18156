import { ActionIcon, Select } from "@mantine/core";
import { IconArrowDown, IconArrowUp, IconGripVertical, IconX } from "@tabler/icons-react";
import { type DragEvent, useState } from "react";
import type { Pdo, PdoFinding, PdoMappable, PdoSetup } from "../../../api/pdo";
import type { DeviceContext } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { bitsOf, moved, titleOfPdo } from "./edits";
import { Findings } from "./Findings";
import { objectName } from "./names";
import classes from "./Pdo.module.css";

interface Props {
  pdo: Pdo;
  setup: PdoSetup;
  mappable: readonly PdoMappable[];
  context: DeviceContext | null;
  findings: readonly PdoFinding[];
  locked: boolean;
  onChange: (mapped: PdoSetup["mapped"]) => void;
}

/** What a PDO carries, in its order: add, remove, and move by button or drag. */
export function MappedList({ pdo, setup, mappable, context, findings, locked, onChange }: Props) {
  const t = useTexts();
  const [dragged, setDragged] = useState<number | null>(null);
  const { mapped } = setup;
  const move = (from: number, to: number) => onChange(moved(mapped, from, to));
  const drop = (to: number) => (event: DragEvent) => {
    event.preventDefault();
    if (dragged !== null) move(dragged, to);
    setDragged(null);
  };
  return (
    <div className={classes.mapped}>
      <h4>
        {t("page.pdo.entries")}{" "}
        <span className="dim">{t("page.pdo.bits_used", { bits: bitsOf(setup) })}</span>
      </h4>
      <ol className={classes.entries}>
        {mapped.map((one, place) => {
          const name = objectName(context, one, t);
          return (
            <li
              key={`${one.object}-${mapped.slice(0, place).filter((other) => other.object === one.object).length}`}
              draggable={!locked}
              data-dragged={dragged === place}
              onDragStart={() => setDragged(place)}
              onDragEnd={() => setDragged(null)}
              onDragOver={(event) => event.preventDefault()}
              onDrop={drop(place)}
              data-testid={`mapped-${place + 1}`}
            >
              <div className={classes.entry}>
                <IconGripVertical size={16} className={classes.grip} aria-hidden />
                <span className={classes.address}>{one.object}</span>
                <span className={classes.entryName}>{name}</span>
                <span className="dim">{t("page.pdo.bits", { bits: one.bits })}</span>
                <Tool
                  label={t("page.pdo.move_up", { name })}
                  disabled={locked || place === 0}
                  onClick={() => move(place, place - 1)}
                  icon={<IconArrowUp size={17} aria-hidden />}
                />
                <Tool
                  label={t("page.pdo.move_down", { name })}
                  disabled={locked || place === mapped.length - 1}
                  onClick={() => move(place, place + 1)}
                  icon={<IconArrowDown size={17} aria-hidden />}
                />
                <Tool
                  label={t("page.pdo.remove", { name })}
                  disabled={locked}
                  onClick={() => onChange(mapped.filter((_one, other) => other !== place))}
                  icon={<IconX size={17} aria-hidden />}
                />
              </div>
              <Findings findings={findings.filter((finding) => finding.entry === place + 1)} />
            </li>
          );
        })}
      </ol>
      <AddObject
        title={titleOfPdo(pdo)}
        options={mappable.filter((one) => one[pdo.direction])}
        context={context}
        disabled={locked}
        onAdd={(one) => onChange([...mapped, { object: one.object, bits: one.bits }])}
      />
      <Findings
        findings={findings.filter((finding) => finding.part === "mapping" && finding.entry === null)}
      />
    </div>
  );
}

interface ToolProps {
  label: string;
  disabled: boolean;
  onClick: () => void;
  icon: React.ReactNode;
}

function Tool({ label, disabled, onClick, icon }: ToolProps) {
  return (
    <ActionIcon
      variant="subtle"
      size={40}
      aria-label={label}
      title={label}
      disabled={disabled}
      onClick={onClick}
    >
      {icon}
    </ActionIcon>
  );
}

interface AddProps {
  title: string;
  options: readonly PdoMappable[];
  context: DeviceContext | null;
  disabled: boolean;
  onAdd: (one: PdoMappable) => void;
}

function AddObject({ title, options, context, disabled, onAdd }: AddProps) {
  const t = useTexts();
  const [text, setText] = useState("");
  const data = options.map((one) => ({
    value: one.object,
    label: `${one.object} · ${objectName(context, one, t)} · ${t("page.pdo.bits", { bits: one.bits })}`,
  }));
  return (
    <Select
      label={t("page.pdo.add")}
      aria-label={`${t("page.pdo.add")} ${title}`}
      placeholder={t("page.pdo.add_hint")}
      data={data}
      value={null}
      searchable
      searchValue={text}
      onSearchChange={setText}
      limit={60}
      disabled={disabled}
      onChange={(object) => {
        const found = options.find((one) => one.object === object);
        if (found) onAdd(found);
        setText("");
      }}
      size="sm"
      data-testid="pdo-add"
    />
  );
}
