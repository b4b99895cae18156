import { Alert, Badge, Button, Loader } from "@mantine/core";
import { IconInfoCircle, IconPlus } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../api/queries";
import { type Site, siteQuery, type SiteTurbine } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import classes from "./Settings.module.css";
import { emptyTurbine } from "./siteDraft";
import { TurbineEditor } from "./TurbineEditor";

const NEW = "";

/** The site file: its turbines, one of them open at a time. */
export function TurbinesSection() {
  const t = useTexts();
  const site = useQuery(siteQuery);
  const [open, setOpen] = useState<string | null>(null);
  if (site.isError) return <ProblemAlert error={site.error} title={t("page.settings.turbines.failed")} />;
  if (!site.data) return <Loader aria-label={t("page.loading")} />;
  const { turbines, connected } = site.data;
  const shown = open === NEW ? emptyTurbine() : turbines.find((one) => one.slug === open);
  const saved = (after: Site, slug: string | null) => {
    queryClient.setQueryData(siteQuery.queryKey, after);
    void queryClient.invalidateQueries({ queryKey: ["turbines"] });
    void queryClient.invalidateQueries({ queryKey: ["settings", "adapters"] });
    void queryClient.invalidateQueries({ queryKey: ["settings", "polling"] });
    setOpen(slug);
  };
  return (
    <>
      <FileLine site={site.data} />
      <div className={classes.row}>
        {turbines.map((one) => (
          <TurbineButton
            key={one.slug}
            turbine={one}
            open={open === one.slug}
            connected={one.slug === connected}
            onOpen={() => setOpen(open === one.slug ? null : one.slug)}
          />
        ))}
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              variant={open === NEW ? "filled" : "default"}
              leftSection={<IconPlus size={18} aria-hidden />}
              disabled={locked || site.data.problem !== null}
              onClick={() => setOpen(NEW)}
              data-testid="add-turbine"
            >
              {t("page.settings.turbines.add")}
            </Button>
          )}
        </NeedsRole>
      </div>
      {shown ? (
        <TurbineEditor
          key={`${open ?? ""} ${site.data.revision}`}
          site={site.data}
          before={shown}
          isNew={open === NEW}
          onSaved={saved}
          onClose={() => setOpen(null)}
        />
      ) : (
        <p className={classes.places}>{t("page.settings.turbines.choose")}</p>
      )}
    </>
  );
}

/** Where the turbines stand written, and whether they can be changed. */
function FileLine({ site }: { site: Site }) {
  const t = useTexts();
  if (site.problem !== null) {
    return (
      <Alert color="yellow" variant="light" icon={<IconInfoCircle aria-hidden />}>
        {t(site.problem)}
      </Alert>
    );
  }
  return (
    <p className={classes.places}>
      {t(site.made ? "page.settings.turbines.file" : "page.settings.turbines.file_new")}{" "}
      <span className={classes.mono}>{site.file}</span>
    </p>
  );
}

interface ButtonProps {
  turbine: SiteTurbine;
  open: boolean;
  connected: boolean;
  onOpen: () => void;
}

function TurbineButton({ turbine, open, connected, onOpen }: ButtonProps) {
  const t = useTexts();
  return (
    <Button
      variant={open ? "filled" : "default"}
      aria-expanded={open}
      onClick={onOpen}
      data-testid={`turbine-${turbine.slug}`}
      rightSection={
        connected && (
          <Badge color="var(--hs-live)" variant="filled" tt="none">
            {t("page.connect.is")}
          </Badge>
        )
      }
    >
      {turbine.name}
    </Button>
  );
}
