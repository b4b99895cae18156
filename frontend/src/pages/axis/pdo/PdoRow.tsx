import { ActionIcon } from "@mantine/core";
import { IconChevronDown, IconEye, IconPencil, IconShieldCheck } from "@tabler/icons-react";
import type { Pdo, PdoFinding, PdoMappable, PdoSetup } from "../../../api/pdo";
import { usePageSearch } from "../../../frame/search";
import { useServerNow } from "../../../live/live";
import type { DeviceContext } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { age } from "../../../ui/format";
import { canIdOf, hexId, isEnabled, nameOf, titleOfPdo } from "./edits";
import { Findings } from "./Findings";
import { MappedList } from "./MappedList";
import { MappingBar } from "./MappingBar";
import { inhibitMs, rateText, typeText } from "./names";
import { PdoFields } from "./PdoFields";
import classes from "./Pdo.module.css";

interface Props {
  pdo: Pdo;
  /** As it is wanted; as it is set up where nothing else is. */
  setup: PdoSetup | null;
  edited: boolean;
  operational: boolean;
  mappable: readonly PdoMappable[];
  context: DeviceContext | null;
  findings: readonly PdoFinding[];
  locked: boolean;
  onChange: (setup: PdoSetup) => void;
}

/** One PDO: when it goes, what it carries, and, opened, how both are changed. */
export function PdoRow(props: Props) {
  const { pdo, setup, edited, context, findings, operational, locked } = props;
  const Icon = locked ? IconEye : IconPencil;
  const t = useTexts();
  const [{ pdo: opened }, update] = usePageSearch();
  const title = titleOfPdo(pdo);
  const open = opened === nameOf(pdo) && setup !== null;
  return (
    <article
      className={classes.pdo}
      aria-label={title}
      data-enabled={setup !== null && isEnabled(setup)}
      data-edited={edited}
      data-testid={`pdo-${nameOf(pdo)}`}
    >
      <header className={classes.head}>
        <h3>{title}</h3>
        {setup === null ? <span className="dim">–</span> : <Facts pdo={pdo} setup={setup} edited={edited} />}
        <ActionIcon
          variant="subtle"
          size={40}
          disabled={setup === null}
          aria-expanded={open}
          aria-label={t(open ? "page.pdo.close_editor" : locked ? "page.pdo.look" : "page.pdo.edit", {
            pdo: title,
          })}
          onClick={() => update({ pdo: open ? undefined : nameOf(pdo) })}
          data-testid={`edit-${nameOf(pdo)}`}
        >
          {open ? <IconChevronDown size={19} aria-hidden /> : <Icon size={19} aria-hidden />}
        </ActionIcon>
      </header>
      {setup !== null && (
        <MappingBar
          title={title}
          setup={setup}
          context={context}
          alive={operational && isEnabled(setup) && !edited}
        />
      )}
      {open && <Editor {...props} setup={setup} />}
      {!open && <Findings findings={findings.filter((one) => one.severity !== "note")} />}
    </article>
  );
}

function Facts({ pdo, setup, edited }: { pdo: Pdo; setup: PdoSetup; edited: boolean }) {
  const t = useTexts();
  const nowMs = useServerNow(1000);
  const on = isEnabled(setup);
  const timers = [
    setup.inhibit_100us > 0 && `${t("page.pdo.inhibit")} ${inhibitMs(setup).toLocaleString(t.language)} ms`,
    setup.event_ms > 0 && `${t("page.pdo.event")} ${setup.event_ms.toLocaleString(t.language)} ms`,
  ].filter((text) => text !== false);
  const seen = pdo.per_second === null || edited || !on ? null : pdo.per_second;
  return (
    <>
      <span className={classes.switch} data-on={on}>
        {t(on ? "page.pdo.enabled_short" : "page.pdo.disabled")}
      </span>
      <span className={classes.id}>{hexId(canIdOf(setup))}h</span>
      <span className={classes.type}>
        {typeText(pdo.direction, setup.transmission_type, t)}
        {timers.length > 0 && <span className="dim"> · {timers.join(" · ")}</span>}
      </span>
      {pdo.stop_path && (
        <span className={classes.stopPath}>
          <IconShieldCheck size={16} aria-hidden /> {t("page.pdo.stop_path")}
        </span>
      )}
      <span className={classes.rate} data-testid={`rate-${nameOf(pdo)}`} data-rate={seen ?? ""}>
        {seen === null
          ? "–"
          : seen > 0
            ? rateText(seen, t)
            : t("page.pdo.seen", { age: age(nowMs - (pdo.seen_t_ns ?? 0) / 1e6, t.language) })}
      </span>
    </>
  );
}

function Editor({ pdo, setup, mappable, context, findings, locked, onChange }: Props) {
  if (setup === null) return null;
  return (
    <div className={classes.editor}>
      <PdoFields pdo={pdo} setup={setup} findings={findings} locked={locked} onChange={onChange} />
      <MappedList
        pdo={pdo}
        setup={setup}
        mappable={mappable}
        context={context}
        findings={findings}
        locked={locked}
        onChange={(mapped) => onChange({ ...setup, mapped })}
      />
    </div>
  );
}
