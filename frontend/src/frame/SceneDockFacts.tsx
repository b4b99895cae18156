import { IconRotateClockwise2, IconWind } from "@tabler/icons-react";
import type { RotorData } from "../api/types";
import { useRotor, useServerNow } from "../live/live";
import { figure } from "../model/values";
import { useTexts } from "../texts/texts";
import { age } from "../ui/format";
import classes from "./SceneDock.module.css";

const REFRESH_MS = 500;

/** Rotor and wind below the picture, or that nobody tells them. */
export function Facts() {
  const t = useTexts();
  const rotor = useRotor();
  if (rotor?.azimuth_deg == null)
    return (
      <div className={`${classes.facts} dim`} data-testid="scene-rotor">
        {t("page.scene.azimuth_unknown")}
      </div>
    );
  if (rotor.stale) return <Stale sinceNs={rotor.t_ns ?? 0} />;
  return (
    <div className={`${classes.facts} bench`} data-testid="scene-rotor">
      <RotorFact rotor={rotor} />
      <WindFact rotor={rotor} />
    </div>
  );
}

function Stale({ sinceNs }: { sinceNs: number }) {
  const t = useTexts();
  const nowMs = useServerNow(REFRESH_MS);
  return (
    <div className={`${classes.facts} tone-warning`} data-testid="scene-rotor">
      {t("page.scene.rotor_stale", { age: age(nowMs - sinceNs / 1e6, t.language) })}
    </div>
  );
}

function RotorFact({ rotor }: { rotor: RotorData }) {
  const t = useTexts();
  return (
    <span title={t("page.scene.rotor")}>
      <IconRotateClockwise2 size={16} aria-label={t("page.scene.rotor")} />
      <b>{t("page.scene.rotor_speed", { speed: figure(rotor.rotor_rpm ?? 0, 1, t.language) })}</b>
      {t("page.scene.azimuth", { angle: figure(rotor.azimuth_deg ?? 0, 0, t.language).padStart(3, " ") })}
    </span>
  );
}

function WindFact({ rotor }: { rotor: RotorData }) {
  const t = useTexts();
  const from = rotor.wind_deg ?? 0;
  const side = t(from < 0 ? "page.scene.wind_from_left" : "page.scene.wind_from_right");
  return (
    <span title={t("page.scene.wind")}>
      <IconWind size={16} aria-label={t("page.scene.wind")} />
      <b>{t("page.scene.wind_speed", { speed: figure(rotor.wind_mps ?? 0, 1, t.language) })}</b>
      {t("page.scene.wind_at", { angle: figure(Math.abs(from), 0, t.language), side })}
    </span>
  );
}
