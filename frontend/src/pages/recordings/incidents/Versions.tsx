import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type Incident, versionsQuery } from "../../../api/incidents";
import { useTexts } from "../../../texts/texts";
import { dayAndTime } from "../../../ui/format";
import classes from "./Incidents.module.css";

/** Who changed what, when: all versions, and what an earlier one said. */
export function Versions({ incident }: { incident: Incident }) {
  const t = useTexts();
  const versions = useQuery(versionsQuery(incident.code)).data ?? [];
  const [shown, setShown] = useState<number | null>(null);
  return (
    <div>
      <h3>{t("page.incidents.versions")}</h3>
      <ul className={classes.versions} data-testid="versions">
        {versions.map((one) => (
          <li key={one.version}>
            <button
              type="button"
              aria-expanded={shown === one.version}
              onClick={() => setShown((before) => (before === one.version ? null : one.version))}
            >
              {t("page.incidents.version", {
                version: one.version,
                person: one.person,
                time: dayAndTime(one.t_ns / 1e6),
              })}
            </button>
            {shown === one.version && (
              <div className={classes.version}>
                <strong>{one.title}</strong>
                <p className={classes.notes}>{one.notes}</p>
                <span className="dim">{one.tags.join(", ")}</span>
              </div>
            )}
          </li>
        ))}
      </ul>
    </div>
  );
}
