import { Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { aboutQuery } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { megabytes } from "../../ui/format";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { PAGE_LIBRARIES } from "./libraries";
import classes from "./Settings.module.css";

export function AboutSection() {
  const t = useTexts();
  const about = useQuery(aboutQuery);
  if (about.isError) return <ProblemAlert error={about.error} title={t("page.settings.about.failed")} />;
  if (!about.data) return <Loader aria-label={t("page.loading")} />;
  const { version, python, system, data, free_bytes: free, libraries } = about.data;
  const facts: [string, string][] = [
    ["version", version],
    ["python", python],
    ["system", system],
    ["data", data ?? "–"],
    ["free", free === null ? "–" : megabytes(free, t.language)],
  ];
  return (
    <>
      <div className={classes.card}>
        <dl className={classes.facts}>
          {facts.map(([name, text]) => (
            <div key={name}>
              <dt>{t(`page.settings.about.${name}`)}</dt>
              <dd>{text}</dd>
            </div>
          ))}
        </dl>
      </div>
      <div
        className={classes.tableBox}
        tabIndex={0}
        role="group"
        aria-label={t("page.settings.about.libraries")}
      >
        <table className={classes.table}>
          <caption className="visually-hidden">{t("page.settings.about.libraries")}</caption>
          <thead>
            <tr>
              {["library", "version", "licence"].map((head) => (
                <th key={head}>{t(`page.settings.about.${head}`)}</th>
              ))}
            </tr>
          </thead>
          <tbody>
            {[...libraries, ...PAGE_LIBRARIES].map((one) => (
              <tr key={one.name}>
                <td>{one.name}</td>
                <td>{one.version}</td>
                <td>{one.licence || "–"}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}
