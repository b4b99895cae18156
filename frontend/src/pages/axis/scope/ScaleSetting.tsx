import { Button, NumberInput, Popover } from "@mantine/core";
import { type KeyboardEvent, type SyntheticEvent, useState } from "react";
import { useTexts } from "../../../texts/texts";
import { typedNumber } from "../../../ui/typedNumber";
import classes from "./Scope.module.css";
import type { PlotGroup } from "./traces";
import type { Pair } from "./view";

interface Props {
  group: PlotGroup;
  /** Set by hand; null: what is in view decides. */
  scale: Pair | null;
  /** What the axis shows now. */
  shown: () => Pair;
  onScale: (scale: Pair | null) => void;
}

/** The unit of a plot. Pressed, it sets the limits of the axis by hand, or gives them back. */
export function ScaleSetting({ group, scale, shown, onScale }: Props) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  const unit = group.unit === "" ? t("page.scope.plot_numbers") : group.unit;
  return (
    <span onPointerDown={keep} onDoubleClick={keep} onKeyDown={keepKey}>
      <Popover opened={open} onChange={setOpen} position="bottom-start" trapFocus withinPortal>
        <Popover.Target>
          <Button
            variant={scale ? "light" : "subtle"}
            size="compact-sm"
            className={classes.scaleButton}
            onClick={() => setOpen(!open)}
            aria-expanded={open}
            title={t("page.scope.scale_explain")}
            data-testid={`scale-${group.key}`}
          >
            {unit}
            {scale && <small>{t("page.scope.scale_by_hand")}</small>}
          </Button>
        </Popover.Target>
        <Popover.Dropdown>
          <Fields
            unit={group.unit}
            first={scale ?? shown()}
            by={scale !== null}
            onScale={(next) => {
              onScale(next);
              setOpen(false);
            }}
          />
        </Popover.Dropdown>
      </Popover>
    </span>
  );
}

interface FieldsProps {
  unit: string;
  first: Pair;
  by: boolean;
  onScale: (scale: Pair | null) => void;
}

function Fields({ unit, first, by, onScale }: FieldsProps) {
  const t = useTexts();
  const [low, setLow] = useState(() => rounded(first[0]));
  const [high, setHigh] = useState(() => rounded(first[1]));
  const wrong = low >= high;
  const suffix = unit === "" ? "" : ` ${unit}`;
  const field = { w: 130, suffix, decimalSeparator: t.language === "de" ? "," : "." };
  return (
    <form
      className={classes.scale}
      onSubmit={(event) => {
        event.preventDefault();
        if (!wrong) onScale([low, high]);
      }}
    >
      <NumberInput
        {...field}
        label={t("page.scope.scale_low")}
        value={low}
        onChange={(value) => typedNumber(value, setLow)}
        error={wrong ? t("page.scope.scale_wrong") : undefined}
        data-autofocus
        data-testid="scale-low"
      />
      <NumberInput
        {...field}
        label={t("page.scope.scale_high")}
        value={high}
        onChange={(value) => typedNumber(value, setHigh)}
        data-testid="scale-high"
      />
      <Button type="submit" disabled={wrong} data-testid="scale-set">
        {t("page.scope.scale_set")}
      </Button>
      <Button variant="default" disabled={!by} onClick={() => onScale(null)} data-testid="scale-auto">
        {t("page.scope.scale_auto")}
      </Button>
    </form>
  );
}

const rounded = (value: number): number => Number(value.toPrecision(4));

/** The plots take what is pressed within them for zooming and cursors. */
const keep = (event: SyntheticEvent) => event.stopPropagation();

const keepKey = (event: KeyboardEvent) => {
  if (event.key !== "Escape") event.stopPropagation();
};
