import { ActionIcon, Tooltip, useComputedColorScheme } from "@mantine/core";
import {
  IconCube,
  IconGhost2,
  IconLayoutSidebarRightCollapse,
  IconLayoutSidebarRightExpand,
  IconPlugConnectedX,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { memo, useEffect, useMemo, useRef, useState } from "react";
import { useTurbineQuery } from "../api/queries";
import { replayOf } from "../live/channel";
import { useCylinders, useShown } from "../live/live";
import { useTexts } from "../texts/texts";
import classes from "./SceneDock.module.css";
import { Facts } from "./SceneDockFacts";
import { Labels, type LabelPlacer } from "./SceneDockLabels";
import { Legend } from "./SceneDockLooks";
import {
  BENCH_CAMERA,
  CAMERAS,
  type CameraName,
  cylindersOf,
  tellScene,
  useSceneMessages,
  type View,
} from "./sceneDockBridge";
import { usePageSearch } from "./search";
import { stopOnEscape } from "./stop";

/** The 3D view, docked at the right; its page is loaded once the rest is there, and only while the dock is open. */
export const SceneDock = memo(function SceneDock() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const open = search.scene !== "off";
  const label = t(open ? "page.scene.close" : "page.scene.open");
  return (
    <aside className={classes.scene} data-open={open} aria-label={t("page.scene.label")}>
      <div className={classes.head}>
        {open && (
          <>
            <IconCube size={18} aria-hidden />
            {t("page.scene.label")}
            <span className={classes.spacer} />
          </>
        )}
        <Tooltip label={label}>
          <ActionIcon
            variant="subtle"
            color="gray"
            aria-label={label}
            aria-expanded={open}
            data-testid="scene-toggle"
            onClick={() => update({ scene: open ? "off" : undefined })}
          >
            {open ? (
              <IconLayoutSidebarRightCollapse aria-hidden />
            ) : (
              <IconLayoutSidebarRightExpand aria-hidden />
            )}
          </ActionIcon>
        </Tooltip>
      </div>
      {open && <SceneView />}
    </aside>
  );
});

const RELOAD_MS = 10_000;
const UNSEEN_MS = 60_000;

enum Link {
  Loading = "loading",
  Up = "up",
  Lost = "lost",
}

function SceneView() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const ready = useIdle();
  const looked = useLookedAt();
  const frame = useRef<HTMLIFrameElement>(null);
  const labels = useRef<LabelPlacer>(null);
  const [link, setLink] = useState(Link.Loading);
  const [freed, setFreed] = useState(false);
  // The frame's script tells that it is there before the frame counts as loaded: what is silent is no 3D view.
  const alive = useRef(false);
  const [attempt, setAttempt] = useState(0);
  const cameras = useCameras();
  const view = useView(cameras);
  const ghosts = cameras.some((camera) => camera !== BENCH_CAMERA);
  // The frame gets its first view by its address; what changes later it is told, without being loaded again.
  const { ctx } = useShown();
  const known = useQuery(useTurbineQuery()).isFetched;
  const [address, setAddress] = useState<string | null>(null);
  if (known && address === null) setAddress(addressOf(view, ctx));

  const select = (blade: number | null) => update({ blade: blade === null ? undefined : String(blade) });
  useSceneMessages(frame, (message) => {
    if (message.hubside === "ready") {
      alive.current = true;
      tellScene(frame.current, view);
    } else if (message.hubside === "link") setLink(message.up ? Link.Up : Link.Lost);
    else if (message.hubside === "select") select(message.blade);
    else if (message.hubside === "freed") setFreed(true);
    else labels.current?.place(message);
  });
  useEffect(() => tellScene(frame.current, view), [view]);

  const fly = (camera: CameraName) => {
    setFreed(false);
    tellScene(frame.current, { ...view, camera }, true);
    update({ camera: camera === cameras[0] ? undefined : camera });
  };
  const loaded = () => {
    // The frame is of our own origin: Esc must stop there as well.
    frame.current?.contentWindow?.addEventListener("keydown", stopOnEscape, { capture: true });
    if (!alive.current) setLink(Link.Lost);
    alive.current = false;
  };
  useEffect(() => {
    if (link !== Link.Lost) return;
    // A view that was there connects again by itself within a second or two; else all of it is asked for anew.
    const again = setTimeout(() => setAttempt((before) => before + 1), RELOAD_MS);
    return () => clearTimeout(again);
  }, [link, attempt]);
  return (
    <>
      <div className={`${classes.body} bench`} data-link={link} data-theme={view.theme}>
        {link === Link.Loading && <div className={classes.wait}>{t("page.scene.loading")}</div>}
        {ready && looked && address !== null && (
          <iframe
            key={attempt}
            ref={frame}
            title={t("page.scene.label")}
            src={address}
            data-testid="scene"
            onLoad={loaded}
          />
        )}
        <Labels ref={labels} camera={view.camera} selected={view.selected} onSelect={select} />
        {link === Link.Lost && <Lost />}
      </div>
      <div className={classes.foot}>
        <Cameras cameras={cameras} chosen={freed ? null : view.camera} onChoose={fly} />
        {ghosts && (
          <GhostSwitch on={view.ghosts} onChange={(on) => update({ ghost: on ? undefined : "off" })} />
        )}
      </div>
      {cameras.includes("front") && <Facts />}
      <Legend ghost={ghosts} />
    </>
  );
}

/** Where one can look from: at blades, at shafts on a bench, at cylinders, or at all that there is. */
function useCameras(): readonly CameraName[] {
  const stations = useQuery(useTurbineQuery()).data?.stations ?? [];
  const cylinders = useCylinders();
  const hydraulic = new Set(cylinders.map(({ station }) => station));
  const blades = stations.length === 0 || stations.some((station) => station.blade !== null);
  const bench = stations.some((station) => station.blade === null && !hydraulic.has(station.slug));
  return useMemo(
    () =>
      CAMERAS.filter((camera) => {
        const number = cylindersOf(camera);
        if (number !== null) return number <= cylinders.length;
        return camera === BENCH_CAMERA ? bench : blades;
      }),
    [bench, blades, cylinders.length],
  );
}

function useView(cameras: readonly CameraName[]): View {
  const [search] = usePageSearch();
  const theme = useComputedColorScheme();
  const camera = cameras.find((name) => name === search.camera) ?? cameras[0] ?? "front";
  const selected = Number(search.blade ?? 0) || null;
  const ghosts = search.ghost !== "off";
  const [view, setView] = useState<View>({ theme, camera, selected, ghosts });
  const same =
    view.theme === theme && view.camera === camera && view.selected === selected && view.ghosts === ghosts;
  if (same) return view;
  const next = { theme, camera, selected, ghosts };
  setView(next);
  return next;
}

/** The bench has one 3D view, each recording one of its own. */
function addressOf(view: View, ctx: string): string {
  const replay = replayOf(ctx);
  const place = replay === null ? "/viser/" : `/viser/replay/${encodeURIComponent(replay)}/`;
  return `${place}?hideViserLogo&camera=${view.camera}${view.theme === "dark" ? "&darkMode" : ""}`;
}

function Lost() {
  const t = useTexts();
  return (
    <div className={classes.lost} role="alert" data-testid="scene-lost">
      <IconPlugConnectedX size={22} aria-hidden />
      <strong>{t("page.scene.lost")}</strong>
      <span>{t("page.scene.lost_explain")}</span>
    </div>
  );
}

function Cameras({
  cameras,
  chosen,
  onChoose,
}: {
  cameras: readonly CameraName[];
  chosen: CameraName | null;
  onChoose: (camera: CameraName) => void;
}) {
  const t = useTexts();
  return (
    <div className={classes.cameras} role="group" aria-label={t("page.scene.cameras")}>
      {cameras.map((camera) => {
        const name = t(`page.scene.camera.${camera}`);
        const several = camera.startsWith("cylinders-") && cameras.includes("cylinders-2");
        const short = camera.startsWith("blade-") || several ? camera.slice(-1) : name;
        return (
          <button
            key={camera}
            type="button"
            aria-label={name}
            title={name}
            aria-pressed={camera === chosen}
            data-testid={`camera-${camera}`}
            onClick={() => onChoose(camera)}
          >
            {short}
          </button>
        );
      })}
    </div>
  );
}

function GhostSwitch({ on, onChange }: { on: boolean; onChange: (on: boolean) => void }) {
  const t = useTexts();
  const label = t("page.scene.ghosts");
  return (
    <Tooltip label={label}>
      <ActionIcon
        variant={on ? "light" : "subtle"}
        aria-label={label}
        aria-pressed={on}
        data-testid="scene-ghosts"
        onClick={() => onChange(!on)}
      >
        <IconGhost2 size={20} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
}

/** False once nobody has seen the page for a while: a picture that nobody sees is not made. */
function useLookedAt(): boolean {
  const [looked, setLooked] = useState(true);
  useEffect(() => {
    let leaving: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      clearTimeout(leaving);
      if (document.hidden) leaving = setTimeout(() => setLooked(false), UNSEEN_MS);
      else setLooked(true);
    };
    document.addEventListener("visibilitychange", look);
    return () => {
      clearTimeout(leaving);
      document.removeEventListener("visibilitychange", look);
    };
  }, []);
  return looked;
}

/** True once the browser has nothing better to do: the page itself comes first. */
function useIdle(): boolean {
  const [idle, setIdle] = useState(false);
  useEffect(() => {
    const handle = requestIdleCallback(() => setIdle(true), { timeout: 1500 });
    return () => cancelIdleCallback(handle);
  }, []);
  return idle;
}
