import { Button } from "@mantine/core";
import { IconPlug, IconPlugOff, IconSettings } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { knownTurbinesQuery } from "../api/settings";
import { useTexts } from "../texts/texts";
import { storyOf } from "../ui/problem";
import { useConnecting } from "./connecting";
import classes from "./Frame.module.css";
import { NeedsRole } from "./NeedsRole";
import { type PageSearch, roomSearch } from "./search";

/** What a room shows that needs a turbine while none is connected: that it is so, and the way on. */
export function Unconnected() {
  const t = useTexts();
  const known = useQuery(knownTurbinesQuery);
  const { connect, busy } = useConnecting();
  const turbines = known.data ?? [];
  const none = known.isSuccess && turbines.length === 0;
  return (
    <section className={classes.unconnected} data-testid="unconnected">
      <h2>
        <IconPlugOff size={22} aria-hidden /> {t("page.unconnected.title")}
      </h2>
      <p>{t(none ? "page.unconnected.none_known" : "page.unconnected.choose")}</p>
      {known.isError && <p className="tone-error">{storyOf(known.error, t).happened}</p>}
      <div className={classes.ways}>
        {turbines.map((one) => (
          <NeedsRole key={one.slug} role="technician" device>
            {(locked) => (
              <Button
                leftSection={<IconPlug size={18} aria-hidden />}
                disabled={locked || busy}
                onClick={() => connect(one.slug)}
                data-testid={`unconnected-${one.slug}`}
              >
                {busy ? t("page.connect.busy") : t("page.unconnected.connect", { turbine: one.name })}
              </Button>
            )}
          </NeedsRole>
        ))}
        <Link
          to="/settings"
          search={(before: PageSearch) => roomSearch(before, { section: "turbines" })}
          data-testid="unconnected-settings"
        >
          <IconSettings size={18} aria-hidden />
          {t(none ? "page.unconnected.set_up" : "page.unconnected.another")}
        </Link>
      </div>
    </section>
  );
}
