import { Badge, Button, Checkbox, Loader, Progress, Select, TextInput } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCircleCheck,
  IconEar,
  IconEarOff,
  IconPlus,
  IconRefresh,
  IconWaveSine,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type SyntheticEvent, useState } from "react";
import { type Adapter, adaptersQuery, type BitrateSearch, type Heard, settings } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { figure } from "../../model/values";
import { type Translate, useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { JobProblem } from "./JobProblem";
import { DEFAULT_BITRATE } from "./siteDraft";
import classes from "./Settings.module.css";
import { useSettingsJob } from "./useSettingsJob";

const USUAL_RATES = [10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

export function AdaptersSection() {
  const t = useTexts();
  const known = useQuery(adaptersQuery);
  const [own, setOwn] = useState<string[]>([]);
  const [open, setOpen] = useState<string | null>(null);
  if (known.isError) return <ProblemAlert error={known.error} title={t("page.settings.adapters.failed")} />;
  if (!known.data) return <Loader aria-label={t("page.loading")} />;
  const add = (text: string) => {
    setOwn([...own, text]);
    setOpen(text);
  };
  const listed = [...known.data.adapters, ...own.map(byHand)];
  return (
    <>
      <div className={classes.row}>
        <OtherAdapter onAdd={add} known={listed} />
        <span className={classes.spacer} />
        <Button
          variant="default"
          leftSection={<IconRefresh size={18} aria-hidden />}
          loading={known.isFetching}
          onClick={() => void known.refetch()}
        >
          {t("page.settings.adapters.again")}
        </Button>
      </div>
      {listed.length === 0 ? (
        <p className={classes.card}>{t("page.settings.adapters.none")}</p>
      ) : (
        <div className={classes.tableBox}>
          <table className={classes.table} data-testid="adapters">
            <thead>
              <tr>
                {["adapter", "silent", "used", "action"].map((head) => (
                  <th key={head} data-head={head}>
                    {t(`page.settings.adapters.head.${head}`)}
                  </th>
                ))}
              </tr>
            </thead>
            <tbody>
              {listed.map((one) => (
                <AdapterRow
                  key={one.connection}
                  adapter={one}
                  open={open === one.connection}
                  onToggle={() => setOpen(open === one.connection ? null : one.connection)}
                />
              ))}
            </tbody>
          </table>
        </div>
      )}
      <p className={classes.places} data-testid="places">
        {t("page.settings.adapters.looked")}{" "}
        {known.data.places
          .map((place) =>
            t(`page.settings.adapters.place.${place.health}`, {
              name: t(`page.settings.interface.${place.interface}`),
              count: place.found,
              reason: place.reason,
            }),
          )
          .join(" · ")}
      </p>
    </>
  );
}

function byHand(connection: string): Adapter {
  const name = connection.split(":")[0] ?? "";
  return {
    connection,
    interface: name,
    title: "",
    // The server knows better and says so when it is asked.
    silent: ["slcan", "pcan", "kvaser", "vector"].includes(name),
    sets_bitrate: !["socketcan", "socketcand", "virtual"].includes(name),
    bitrates: [],
    found: false,
    turbines: [],
    in_use: false,
  };
}

function OtherAdapter({ onAdd, known }: { onAdd: (text: string) => void; known: readonly Adapter[] }) {
  const t = useTexts();
  const [text, setText] = useState("");
  const plain = text.trim().replace(/@\w+$/, "");
  const wrong = plain !== "" && !/^[a-z]+:.+/.test(plain);
  const add = (event: SyntheticEvent) => {
    event.preventDefault();
    if (plain === "" || wrong || known.some((one) => one.connection === plain)) return;
    onAdd(plain);
    setText("");
  };
  return (
    <form className={classes.row} onSubmit={add}>
      <TextInput
        w={330}
        aria-label={t("page.settings.adapters.other")}
        placeholder={t("page.settings.adapters.other_hint")}
        value={text}
        error={wrong ? t("page.settings.flaw.connection") : undefined}
        onChange={(event) => setText(event.currentTarget.value)}
        data-testid="other-adapter"
      />
      <Button
        type="submit"
        variant="default"
        disabled={plain === "" || wrong}
        leftSection={<IconPlus size={18} aria-hidden />}
        data-testid="add-adapter"
      >
        {t("page.settings.adapters.other_add")}
      </Button>
    </form>
  );
}

interface RowProps {
  adapter: Adapter;
  open: boolean;
  onToggle: () => void;
}

function AdapterRow({ adapter, open, onToggle }: RowProps) {
  const t = useTexts();
  const Ear = adapter.silent ? IconEar : IconEarOff;
  return (
    <>
      <tr data-open={open} data-testid={`adapter-${adapter.connection}`}>
        <td>
          <div className={classes.mono}>{adapter.connection}</div>
          <div className="dim" style={{ fontSize: 13 }}>
            {[interfaceName(adapter.interface, t), adapter.title].filter(Boolean).join(", ")}
          </div>
        </td>
        <td style={{ whiteSpace: "nowrap" }}>
          <Ear size={18} aria-hidden style={{ verticalAlign: "-4px" }} />{" "}
          {t(adapter.silent ? "page.settings.adapters.silent" : "page.settings.adapters.not_silent")}
        </td>
        <td>
          {adapter.turbines.join(", ") || "–"}{" "}
          {adapter.in_use && (
            <Badge color="var(--hs-live)" variant="filled" tt="none">
              {t("page.settings.adapters.in_use")}
            </Badge>
          )}
        </td>
        <td>
          <div className={classes.actions}>
            <Button
              variant={open ? "filled" : "default"}
              aria-expanded={open}
              onClick={onToggle}
              data-testid={`check-${adapter.connection}`}
            >
              {t(open ? "page.close" : "page.settings.adapters.check")}
            </Button>
          </div>
        </td>
      </tr>
      {open && (
        <tr data-open>
          <td colSpan={4}>
            <Check adapter={adapter} />
          </td>
        </tr>
      )}
    </>
  );
}

/** What an interface is, as people know it; nothing for one that is not known here. */
function interfaceName(name: string, t: Translate): string {
  const key = `page.settings.interface.${name}`;
  return t.has(key) ? t(key) : "";
}

/** Test and search of one adapter; only one of them runs at a time. */
function Check({ adapter }: { adapter: Adapter }) {
  const t = useTexts();
  const work = useSettingsJob();
  const [bitrate, setBitrate] = useState(DEFAULT_BITRATE);
  const [sure, setSure] = useState(false);
  const risky = adapter.sets_bitrate && !adapter.silent && !adapter.in_use;
  const { job, running } = work;
  return (
    <div className={classes.turbine}>
      <div className={classes.row} style={{ alignItems: "flex-start" }}>
        <BitrateSelect adapter={adapter} value={bitrate} onChange={setBitrate} />
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              mt={25}
              leftSection={<IconEar size={18} aria-hidden />}
              disabled={locked || running || (risky && !sure)}
              onClick={() => work.start(() => settings.test(adapter.connection, bitrate, sure))}
              data-testid="start-test"
            >
              {t("page.settings.adapters.test")}
            </Button>
          )}
        </NeedsRole>
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              mt={25}
              variant="default"
              leftSection={<IconWaveSine size={18} aria-hidden />}
              disabled={locked || running}
              onClick={() => work.start(() => settings.search(adapter.connection))}
              data-testid="start-search"
            >
              {t("page.settings.adapters.search")}
            </Button>
          )}
        </NeedsRole>
        {running && (
          <Button mt={25} variant="subtle" onClick={work.cancel}>
            {t("page.cancel")}
          </Button>
        )}
      </div>
      {risky && (
        <Checkbox
          label={t("page.settings.adapters.sure", { kbit: bitrate / 1000 })}
          checked={sure}
          onChange={(event) => setSure(event.currentTarget.checked)}
        />
      )}
      {running && job && (
        <Progress
          value={job.total === 0 ? 0 : (100 * job.done) / job.total}
          aria-label={t("page.settings.adapters.progress")}
        />
      )}
      <JobProblem work={work} title={t("page.settings.adapters.job_failed")} />
      {job?.heard && <HeardFacts heard={job.heard} />}
      {job?.search && <SearchFacts search={job.search} onTake={setBitrate} />}
    </div>
  );
}

interface SelectProps {
  adapter: Adapter;
  value: number;
  onChange: (bitrate: number) => void;
}

function BitrateSelect({ adapter, value, onChange }: SelectProps) {
  const t = useTexts();
  const rates = adapter.bitrates.length > 0 ? adapter.bitrates : USUAL_RATES;
  return (
    <Select
      w={150}
      label={t("page.settings.adapters.bitrate")}
      inputWrapperOrder={["label", "input", "description", "error"]}
      description={adapter.sets_bitrate ? undefined : t("page.settings.adapters.bitrate_set")}
      data={rates.map((rate) => ({ value: String(rate), label: kbit(rate, t) }))}
      value={String(value)}
      allowDeselect={false}
      onChange={(text) => onChange(Number(text))}
      data-testid="bitrate"
    />
  );
}

export function kbit(bitrate: number, t: Translate): string {
  return t("page.settings.adapters.kbit", {
    kbit: figure(bitrate / 1000, bitrate % 1000 === 0 ? 0 : 1, t.language),
  });
}

const VERDICTS = {
  listening: { tone: "dim", Icon: IconEar },
  fits: { tone: "tone-ok", Icon: IconCircleCheck },
  errors: { tone: "tone-error", Icon: IconAlertTriangle },
  silent: { tone: "tone-warning", Icon: IconAlertTriangle },
};

function HeardFacts({ heard }: { heard: Heard }) {
  const t = useTexts();
  const { tone, Icon } = VERDICTS[heard.verdict];
  const facts: [string, string][] = [
    ["frames", figure(heard.frames_per_s, 0, t.language)],
    ["load", `${figure(heard.load * 100, 1, t.language)} %`],
    ["errors", String(heard.errors)],
    ["nodes", heard.nodes.join(", ") || "–"],
    ["masters", heard.masters.map((one) => t(`page.settings.master.${one.sign}`)).join(", ") || "–"],
  ];
  return (
    <div data-testid="heard" data-verdict={heard.verdict}>
      <p className={`${classes.verdict} ${tone}`} role="status">
        <Icon size={20} aria-hidden />
        <span>
          {t(`page.settings.verdict.${heard.verdict}`, { kbit: kbit(heard.bitrate, t) })}
          <small>{t(verdictNext(heard))}</small>
        </span>
      </p>
      <dl className={classes.facts}>
        {facts.map(([name, text]) => (
          <div key={name}>
            <dt>{t(`page.settings.heard.${name}`)}</dt>
            <dd data-testid={`heard-${name}`}>{text}</dd>
          </div>
        ))}
      </dl>
      {heard.shared && <p className={classes.places}>{t("page.settings.heard.shared")}</p>}
    </div>
  );
}

/** What to do with what was heard. */
function verdictNext(heard: Heard): string {
  if (heard.verdict === "silent" && heard.silent) return "page.settings.verdict_next.silent_alone";
  return `page.settings.verdict_next.${heard.verdict}`;
}

function SearchFacts({ search, onTake }: { search: BitrateSearch; onTake: (bitrate: number) => void }) {
  const t = useTexts();
  const tried = new Map(search.tried.map((one) => [one.bitrate, one]));
  const stateOf = (rate: number) => {
    if (rate === search.bitrate) return "found";
    if (rate === search.trying) return "trying";
    return tried.has(rate) ? "tried" : "waiting";
  };
  return (
    <div data-testid="search">
      <ul className={classes.rates}>
        {search.rates.map((rate) => {
          const state = stateOf(rate);
          return (
            <li key={rate} data-state={state}>
              {state === "found" && <IconCircleCheck size={16} aria-hidden />}
              {kbit(rate, t)} · {t(`page.settings.search.${state}`, { frames: tried.get(rate)?.frames ?? 0 })}
            </li>
          );
        })}
      </ul>
      {search.bitrate !== null && (
        <div className={classes.row} style={{ marginTop: 12 }}>
          <strong className="tone-ok" data-testid="found-bitrate">
            {t("page.settings.search.result", { kbit: kbit(search.bitrate, t) })}
          </strong>
          <Button variant="default" onClick={() => onTake(search.bitrate ?? DEFAULT_BITRATE)}>
            {t("page.settings.search.take")}
          </Button>
        </div>
      )}
    </div>
  );
}
