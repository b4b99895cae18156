import { SegmentedControl, useComputedColorScheme } from "@mantine/core";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import classes from "./Settings.module.css";

/** Both are of this window and stand in its URL, so that a link opens as it was seen. */
export function LanguageSection() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const scheme = useComputedColorScheme();
  return (
    <>
      <div className={classes.card}>
        <h2 id="language-title">{t("page.settings.language.language")}</h2>
        <SegmentedControl
          aria-labelledby="language-title"
          size="md"
          value={t.language}
          data={[
            { value: "en", label: "English" },
            { value: "de", label: "Deutsch" },
          ]}
          onChange={(value) => update({ lang: value })}
        />
      </div>
      <div className={classes.card}>
        <h2 id="theme-title">{t("page.settings.language.theme")}</h2>
        <SegmentedControl
          aria-labelledby="theme-title"
          size="md"
          value={scheme}
          data={[
            { value: "dark", label: t("page.settings.language.dark") },
            { value: "light", label: t("page.settings.language.light") },
          ]}
          onChange={(value) => update({ theme: value })}
        />
      </div>
      <p className={classes.places}>{t("page.settings.language.note")}</p>
    </>
  );
}
