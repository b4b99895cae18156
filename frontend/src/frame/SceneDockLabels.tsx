import { type Ref, useImperativeHandle, useRef } from "react";
import { useQueries, useQuery } from "@tanstack/react-query";
import { useDescriptionQuery, useTurbineQuery } from "../api/queries";
import type { AxisData } from "../api/types";
import { useAxis, useWatchDevice } from "../live/live";
import { axisStateKey, shaftLook } from "../model/axisState";
import { figure } from "../model/values";
import { useTexts } from "../texts/texts";
import { type Place, placesOf, stationName } from "../ui/devices";
import { timeOfDay } from "../ui/format";
import { entriesOf, useDeviceContext, useReading } from "../ui/reading";
import { CylinderLabels } from "./SceneDockCylinders";
import { LookSign } from "./SceneDockLooks";
import classes from "./SceneDock.module.css";
import { arranged, BENCH_CAMERA, type CameraName, cylindersOf, type Places } from "./sceneDockBridge";

const BLADES = [1, 2, 3];
const MARKS = [0, 90, 95];
const FEATHER = 90;
const [POSITION, STATUSWORD, ERROR_CODE] = ["6064", "6041", "603F"] as const;

export interface LabelPlacer {
  place: (places: Places) => void;
}

interface Props {
  camera: CameraName;
  selected: number | null;
  onSelect: (blade: number | null) => void;
  ref: Ref<LabelPlacer>;
}

/** The labels over the picture: text of the page, so that it is sharp, translated and reached by keyboard. */
export function Labels({ camera, selected, onSelect, ref }: Props) {
  const t = useTexts();
  const layer = useRef<HTMLDivElement>(null);
  const near = nearBlade(camera);
  const actuator = cylindersOf(camera);
  const shown = camera === BENCH_CAMERA || actuator !== null ? [] : near === null ? BLADES : [near];
  const shafts = useShafts(camera === BENCH_CAMERA);
  // Places come with every move of camera or rotor: they are set without rendering anything anew.
  useImperativeHandle(
    ref,
    () => ({ place: (places) => layer.current && setPlaces(layer.current, places) }),
    [],
  );
  return (
    <div className={classes.labels} ref={layer}>
      {shown.map((blade) => (
        <BladeLabel
          key={blade}
          blade={blade}
          place={camera === "front" ? `blade-${blade}` : `root-${blade}`}
          selected={blade === selected}
          onSelect={onSelect}
        />
      ))}
      {actuator !== null && <CylinderLabels number={actuator} />}
      {shafts.map((place, at) => (
        <ShaftLabel key={place.device.slug} place={place} number={at + 1} />
      ))}
      {near !== null &&
        MARKS.map((degrees) => (
          <span
            key={degrees}
            className={classes.mark}
            data-place={`mark-${near}-${degrees}`}
            data-feather={degrees === FEATHER}
          >
            {degrees}°{degrees === FEATHER && ` ${t("page.scene.feather")}`}
          </span>
        ))}
    </div>
  );
}

interface BladeLabelProps {
  blade: number;
  place: string;
  selected: boolean;
  onSelect: (blade: number | null) => void;
}

function BladeLabel({ blade, place, selected, onSelect }: BladeLabelProps) {
  const t = useTexts();
  const { look, state } = useAxis(blade, (axis) => {
    const seen = axis?.look ?? "unknown";
    return { look: seen, state: stateWord(t, axis, seen) };
  });
  return (
    <button
      type="button"
      className={classes.label}
      data-look={look}
      data-place={place}
      data-blade={blade}
      data-testid={`scene-label-${blade}`}
      aria-pressed={selected}
      title={t("page.scene.select", { blade })}
      onClick={() => onSelect(selected ? null : blade)}
    >
      <LookSign look={look} />
      <b>{blade}</b>
      <BladeAngle blade={blade} />
      <span className={classes.state}>{state}</span>
    </button>
  );
}

function BladeAngle({ blade }: { blade: number }) {
  const { language } = useTexts();
  const angle = useAxis(blade, (axis) =>
    axis?.position_deg == null ? "–" : `${figure(axis.position_deg, 2, language)}°`,
  );
  return <span className={classes.angle}>{angle}</span>;
}

/** The axes that stand on a bench, in the order in which the 3D view numbers them. */
function useShafts(wanted: boolean): Place[] {
  const turbine = useQuery(useTurbineQuery()).data;
  const describe = useDescriptionQuery();
  const places = wanted ? placesOf(turbine).filter(({ station }) => station.blade === null) : [];
  const docs = useQueries({ queries: places.map(({ device }) => describe(device.description_id)) });
  return places.filter((_, at) => {
    const doc = docs[at]?.data;
    return doc !== undefined && entriesOf(doc).has(STATUSWORD) && entriesOf(doc).has(POSITION);
  });
}

function ShaftLabel({ place: { device, station }, number }: { place: Place; number: number }) {
  const t = useTexts();
  useWatchDevice(device.slug);
  const context = useDeviceContext(device);
  const position = useReading(context, POSITION, "fast");
  const status = useReading(context, STATUSWORD, "fast");
  const fault = useReading(context, ERROR_CODE, "slow");
  const word = typeof status?.raw === "number" ? status.raw : null;
  const code = typeof fault?.raw === "number" ? fault.raw : null;
  const look = position === null ? "unknown" : position.stale ? "stale" : shaftLook(word, code);
  const state = word === null ? null : axisStateKey(word);
  return (
    <span
      className={classes.label}
      data-look={look}
      data-place={`shaft-${number}`}
      data-blade={number}
      data-testid={`scene-shaft-${number}`}
    >
      <LookSign look={look} />
      <b>{stationName(station, t)}</b>
      <span className={classes.angle}>
        {position === null ? "–" : `${position.text}${position.unit === "°" ? "" : " "}${position.unit}`}
      </span>
      <span className={classes.state}>
        {state === null || look === "stale" || look === "unknown" ? t(`page.look.${look}`) : t(state)}
      </span>
    </span>
  );
}

/** The state of the drive; what is not the present says so first, and since when. */
function stateWord(t: ReturnType<typeof useTexts>, axis: AxisData | undefined, look: string): string {
  const sinceNs = axis?.position_t_ns ?? null;
  if (look === "stale" && sinceNs !== null)
    return t("page.look.stale_since", { time: timeOfDay(sinceNs / 1e6, 0) });
  const state = axis?.state;
  return state == null || look === "stale" || look === "unknown" ? t(`page.look.${look}`) : t(state);
}

const nearBlade = (camera: CameraName): number | null =>
  Number(/^blade-(\d)$/.exec(camera)?.[1] ?? 0) || null;

function setPlaces(layer: HTMLElement, { places, width, height }: Places): void {
  const byId = new Map(places.map((place) => [place.id, place]));
  const labels = [...layer.querySelectorAll<HTMLElement>("[data-blade]")];
  const wanted = labels.map((label) => {
    const at = byId.get(label.dataset.place ?? "") ?? { x: width / 2, y: height / 2 };
    return { x: at.x, y: at.y, box: { width: label.offsetWidth, height: label.offsetHeight } };
  });
  arranged(wanted, { width, height }).forEach((at, i) => labels[i] && moveTo(labels[i], at));
  for (const mark of layer.querySelectorAll<HTMLElement>(`.${classes.mark}`)) {
    const at = byId.get(mark.dataset.place ?? "");
    mark.hidden = at?.faces !== true;
    if (at) moveTo(mark, at);
  }
}

function moveTo(element: HTMLElement, { x, y }: { x: number; y: number }): void {
  element.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
  element.dataset.placed = "true";
}
