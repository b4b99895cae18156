import { Button, TextInput } from "@mantine/core";
import { IconDeviceFloppy, IconPlus, IconTrash } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { Problem } from "../../api/client";
import { queryClient } from "../../api/queries";
import { settings, type Site, type SiteStation, siteQuery, type SiteTurbine } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { HoldButton } from "../../ui/HoldButton";
import { notify } from "../../ui/notices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { BusEditor } from "./BusEditor";
import { FlawContext, useFlaw, type FlawTexts } from "./flaws";
import classes from "./Settings.module.css";
import { fieldOf, flawsOf, newStation, sameTurbine } from "./siteDraft";
import { StationEditor } from "./StationEditor";

interface Props {
  site: Site;
  before: SiteTurbine;
  isNew: boolean;
  onSaved: (after: Site, slug: string | null) => void;
  onClose: () => void;
}

/** One turbine as a draft: nothing is written before "Save". What is wrong is said at its field. */
export function TurbineEditor({ site, before, isNew, onSaved, onClose }: Props) {
  const t = useTexts();
  const [draft, setDraft] = useState(before);
  const saving = useSaving(site, isNew, onSaved);
  const others = site.turbines.filter((one) => isNew || one.slug !== before.slug).map((one) => one.slug);
  const flaws = flawsOf(draft, others);
  const touched = !sameTurbine(draft, before);
  // An untouched form is not wrong yet, only empty.
  const told = touched ? flaws : [];
  const shown: FlawTexts = new Map(told.map((one) => [one.at, t(one.key, one.details)]));
  const complaint = saving.error instanceof Problem ? complaintOf(saving.error, draft.slug) : null;
  if (complaint) shown.set(complaint.at, complaint.text);
  const stations = (change: readonly SiteStation[]) => setDraft({ ...draft, stations: [...change] });
  return (
    <FlawContext value={shown}>
      <div className={classes.turbine} data-testid="turbine-editor">
        <Names draft={draft} isNew={isNew} onChange={setDraft} />
        <BusEditor site={site} draft={draft} before={isNew ? null : before} onChange={setDraft} />
        {draft.stations.map((station, at) => (
          <StationEditor
            key={at}
            station={station}
            draft={draft}
            descriptions={site.descriptions}
            known={before.stations.find((one) => one.slug === station.slug)}
            onChange={(changed) => stations(draft.stations.with(at, changed))}
            onRemove={() => stations(draft.stations.toSpliced(at, 1))}
          />
        ))}
        <AddStation draft={draft} onAdd={(slug) => stations([...draft.stations, newStation(slug)])} />
        {saving.error !== null && (
          <ProblemAlert error={saving.error} title={t("page.settings.turbines.not_saved")} />
        )}
        <div className={classes.foot}>
          <NeedsRole role="technician">
            {(locked) => (
              <Button
                leftSection={<IconDeviceFloppy size={18} aria-hidden />}
                disabled={locked || flaws.length > 0 || !touched || site.problem !== null}
                loading={saving.isPending}
                onClick={() => saving.save(draft)}
                data-testid="save-turbine"
              >
                {t("page.settings.save")}
              </Button>
            )}
          </NeedsRole>
          <Button variant="default" onClick={() => (touched && !isNew ? setDraft(before) : onClose())}>
            {t(touched && !isNew ? "page.settings.discard" : "page.close")}
          </Button>
          {touched && flaws.length > 0 && (
            <span className="tone-error" role="status">
              {t("page.settings.flaws", { count: flaws.length })}
            </span>
          )}
          <span className={classes.spacer} />
          {!isNew && (
            <RemoveTurbine site={site} turbine={before} onRemoved={(after) => onSaved(after, null)} />
          )}
        </div>
        {!isNew && site.connected === before.slug && touched && (
          <p className={classes.places}>{t("page.settings.turbines.reconnect")}</p>
        )}
      </div>
    </FlawContext>
  );
}

/** The field that the server complains of, with its words. */
function complaintOf(problem: Problem, slug: string): { at: string; text: string } | null {
  const { code, details } = problem.doc;
  if (code !== "site" || typeof details.key !== "string") return null;
  return { at: fieldOf(details.key, slug), text: typeof details.reason === "string" ? details.reason : "" };
}

interface Saving {
  save: (draft: SiteTurbine) => void;
  error: Error | null;
  isPending: boolean;
}

function useSaving(site: Site, isNew: boolean, onSaved: Props["onSaved"]): Saving {
  const t = useTexts();
  const saving = useMutation({
    mutationFn: (draft: SiteTurbine) =>
      isNew ? settings.addTurbine(site.revision, draft) : settings.changeTurbine(site.revision, draft),
    onSuccess: (after, draft) => {
      notify({ tone: "ok", title: t("page.settings.turbines.saved", { name: draft.name }), lines: [] });
      onSaved(after, draft.slug);
    },
  });
  return { save: saving.mutate, error: saving.error, isPending: saving.isPending };
}

interface NamesProps {
  draft: SiteTurbine;
  isNew: boolean;
  onChange: (draft: SiteTurbine) => void;
}

function Names({ draft, isNew, onChange }: NamesProps) {
  const t = useTexts();
  const slugFlaw = useFlaw("slug");
  const nameFlaw = useFlaw("name");
  return (
    <div className={classes.card}>
      <div className={classes.row} style={{ alignItems: "flex-start" }}>
        <TextInput
          w={260}
          label={t("page.settings.turbines.name")}
          value={draft.name}
          error={nameFlaw}
          onChange={(event) => onChange({ ...draft, name: event.currentTarget.value })}
          data-testid="turbine-name"
        />
        <TextInput
          w={260}
          label={t("page.settings.turbines.slug")}
          description={isNew ? t("page.settings.turbines.slug_new") : t("page.settings.turbines.slug_fixed")}
          inputWrapperOrder={["label", "input", "description", "error"]}
          value={draft.slug}
          error={slugFlaw}
          readOnly={!isNew}
          variant={isNew ? "default" : "filled"}
          onChange={(event) => onChange({ ...draft, slug: event.currentTarget.value })}
          data-testid="turbine-slug"
        />
      </div>
    </div>
  );
}

function AddStation({ draft, onAdd }: { draft: SiteTurbine; onAdd: (slug: string) => void }) {
  const t = useTexts();
  const taken = draft.stations.map((one) => one.slug);
  const free = ["blade-1", "blade-2", "blade-3", "bench"].filter((slug) => !taken.includes(slug));
  if (free.length === 0) return null;
  return (
    <div className={classes.row}>
      {free.map((slug) => (
        <Button
          key={slug}
          variant="default"
          leftSection={<IconPlus size={18} aria-hidden />}
          onClick={() => onAdd(slug)}
          data-testid={`add-station-${slug}`}
        >
          {slug === "bench" ? t("page.settings.turbines.bench") : t("page.blade", { blade: slug.slice(-1) })}
        </Button>
      ))}
    </div>
  );
}

interface RemoveProps {
  site: Site;
  turbine: SiteTurbine;
  onRemoved: (after: Site) => void;
}

/** Taking a turbine out needs a deliberate gesture; what was recorded and kept of it stays. */
function RemoveTurbine({ site, turbine, onRemoved }: RemoveProps) {
  const t = useTexts();
  const [asked, setAsked] = useState(false);
  const removing = useMutation({
    mutationFn: () => settings.removeTurbine(site.revision, turbine.slug),
    onSuccess: onRemoved,
    onError: () => void queryClient.invalidateQueries({ queryKey: siteQuery.queryKey }),
  });
  if (removing.error !== null) {
    return <ProblemAlert error={removing.error} title={t("page.settings.turbines.not_removed")} />;
  }
  if (asked) {
    return (
      <HoldButton
        tone="danger"
        hint={t("page.hold")}
        onHeld={() => removing.mutate()}
        disabled={removing.isPending}
        testId="remove-turbine-hold"
      >
        {t("page.settings.turbines.remove_held", { name: turbine.name })}
      </HoldButton>
    );
  }
  const connected = site.connected === turbine.slug;
  return (
    <NeedsRole role="technician">
      {(locked) => (
        <Button
          variant="subtle"
          color="red"
          leftSection={<IconTrash size={18} aria-hidden />}
          disabled={locked || connected || site.problem !== null}
          title={connected ? t("settings.refused.turbine_connected") : undefined}
          onClick={() => setAsked(true)}
          data-testid="remove-turbine"
        >
          {t("page.settings.turbines.remove")}
        </Button>
      )}
    </NeedsRole>
  );
}
