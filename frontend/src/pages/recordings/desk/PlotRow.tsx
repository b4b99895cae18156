import { ActionIcon, Button, Menu, TextInput } from "@mantine/core";
import { IconArrowDown, IconArrowUp, IconDotsVertical, IconTrash, IconX } from "@tabler/icons-react";
import { memo, useState } from "react";
import type { Track } from "../../../model/tracks";
import type { Stretch } from "../../../replay/looking";
import { type Translate, useTexts } from "../../../texts/texts";
import classes from "./Desk.module.css";
import { useDrop } from "./drag";
import { Lines } from "./Legend";
import { unitsOf } from "./looks";
import type { Room } from "./place";
import { Plot } from "./Plot";
import { Spread } from "./Spread";
import type { DeskSignal } from "./signals";
import type { Plots } from "./usePlots";
import type { PlotSpec } from "./view";

interface Props {
  at: number;
  plot: PlotSpec;
  signals: readonly DeskSignal[];
  tracks: ReadonlyMap<string, Track>;
  whole: Stretch;
  room: Room;
  plots: Plots;
}

const TALL = 4;

/** What a plot is called: its objects. */
export const titleOf = (signals: readonly DeskSignal[]): string =>
  [...new Set(signals.map((one) => one.title))].join(", ");

/** A plot and beside it what is drawn there, with the values at the cursor. */
export const PlotRow = memo(function PlotRow(props: Props) {
  const { at, plot, signals, tracks, whole, room, plots } = props;
  const t = useTexts();
  const { over, handlers } = useDrop((signal) => plots.add(signal, at));
  const title = titleOf(signals);
  return (
    <section
      className={classes.row}
      data-tall={signals.length > TALL}
      data-drop={over}
      aria-label={t("desk.plot", { title })}
      data-testid={`plot-${at}`}
      {...handlers}
    >
      <Plot plot={plot} signals={signals} tracks={tracks} whole={whole} room={room} label={title} />
      <div className={`${classes.legend} bench`}>
        <Lines
          signals={signals}
          tracks={tracks}
          whole={whole}
          menu={<PlotMenu at={at} plot={plot} signals={signals} plots={plots} />}
        />
        {plot.band && <Spread signals={signals} />}
      </div>
    </section>
  );
});

function PlotMenu({ at, plot, signals, plots }: Pick<Props, "at" | "plot" | "signals" | "plots">) {
  const t = useTexts();
  const label = t("desk.plot_menu", { title: titleOf(signals) });
  return (
    <Menu position="bottom-end" withinPortal shadow="md">
      <Menu.Target>
        <ActionIcon
          className={classes.small ?? ""}
          variant="subtle"
          aria-label={label}
          title={label}
          data-testid={`plot-menu-${at}`}
        >
          <IconDotsVertical size={16} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item
          leftSection={<IconArrowUp size={16} />}
          disabled={at === 0}
          onClick={() => plots.move(at, at - 1)}
        >
          {t("desk.up")}
        </Menu.Item>
        <Menu.Item
          leftSection={<IconArrowDown size={16} />}
          disabled={at === plots.list.length - 1}
          onClick={() => plots.move(at, at + 1)}
        >
          {t("desk.down")}
        </Menu.Item>
        <Menu.Item onClick={() => plots.change(at, { band: !plot.band })}>
          {t(plot.band ? "desk.band_off" : "desk.band_on")}
        </Menu.Item>
        <Menu.Divider />
        <RangeForm at={at} plot={plot} unit={unitsOf(signals)[0] ?? ""} plots={plots} t={t} />
        <Menu.Divider />
        {signals.map((one) => (
          <Menu.Item
            key={one.name}
            leftSection={<IconX size={16} />}
            onClick={() => plots.remove(one.name, at)}
            data-testid={`remove-${one.name}`}
          >
            {t("desk.remove_signal", { signal: `${one.stationTitle}, ${one.title}` })}
          </Menu.Item>
        ))}
        <Menu.Item color="red" leftSection={<IconTrash size={16} />} onClick={() => plots.drop(at)}>
          {t("desk.remove_plot")}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

interface RangeProps {
  at: number;
  plot: PlotSpec;
  unit: string;
  plots: Plots;
  t: Translate;
}

/** Fixes the limits of the first axis; empty lets them follow the signals. */
function RangeForm({ at, plot, unit, plots, t }: RangeProps) {
  const [low, setLow] = useState(plot.range === null ? "" : String(plot.range[0]));
  const [high, setHigh] = useState(plot.range === null ? "" : String(plot.range[1]));
  const number = (text: string) => (text.trim() === "" ? NaN : Number(text.replace(",", ".")));
  const fits = number(low) < number(high);
  return (
    <form
      className={classes.range}
      onSubmit={(event) => {
        event.preventDefault();
        if (fits) plots.change(at, { range: [number(low), number(high)] });
      }}
    >
      <TextInput
        aria-label={t("desk.range_low", { unit })}
        placeholder={t("desk.low")}
        value={low}
        onChange={(event) => setLow(event.currentTarget.value)}
      />
      <TextInput
        aria-label={t("desk.range_high", { unit })}
        placeholder={t("desk.high")}
        value={high}
        onChange={(event) => setHigh(event.currentTarget.value)}
      />
      <Button type="submit" variant="default" disabled={!fits}>
        {t("desk.range_fix")}
      </Button>
      <Button
        variant="default"
        disabled={plot.range === null}
        onClick={() => plots.change(at, { range: null })}
      >
        {t("desk.range_auto")}
      </Button>
    </form>
  );
}
