import { ActionIcon, Tooltip, useComputedColorScheme } from "@mantine/core";
import { IconCube, IconLayoutSidebarRightCollapse, IconLayoutSidebarRightExpand } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { usePageSearch } from "./search";
import { stopOnEscape } from "./stop";

const PARAMETERS = "hideViserLogo";

/** The 3D view, docked at the right; its page is loaded once the rest is there, and only while the dock is open. */
export function SceneDock() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const open = search.scene !== "off";
  const label = t(open ? "page.scene.close" : "page.scene.open");
  return (
    <aside className={classes.scene} data-open={open} aria-label={t("page.scene.label")}>
      <div className={classes.sceneHead}>
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
}

function SceneView() {
  const t = useTexts();
  const scheme = useComputedColorScheme();
  const ready = useIdle();
  const frame = useRef<HTMLIFrameElement>(null);
  // The frame is of our own origin: Esc must stop there as well.
  const listen = () =>
    frame.current?.contentWindow?.addEventListener("keydown", stopOnEscape, { capture: true });
  return (
    <div className={`${classes.sceneBody} bench`}>
      <div className={classes.sceneWait}>{t("page.scene.loading")}</div>
      {ready && (
        <iframe
          ref={frame}
          title={t("page.scene.label")}
          src={`/viser/?${PARAMETERS}${scheme === "dark" ? "&darkMode" : ""}`}
          data-testid="scene"
          onLoad={listen}
        />
      )}
    </div>
  );
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
