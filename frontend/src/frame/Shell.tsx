import { Center, Loader, MantineProvider } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { lazy, Suspense, useEffect, useMemo } from "react";
import { onSignedOut, Problem } from "../api/client";
import { queryClient, sessionQuery, textsQuery, turbineQuery } from "../api/queries";
import type { Language } from "../api/types";
import { startLive, useBench } from "../live/live";
import { bootTranslator, TextsContext, translator } from "../texts/texts";
import { Frame } from "./Frame";
import { NoAccess } from "./NoAccess";
import { type Theme, usePageSearch } from "./search";
import { theme as mantineTheme } from "./theme";

const UNAUTHORISED = 401;
const LOGIN_NEEDED = "login_needed";
const RETRY_MS = 2000;
const Login = lazy(async () => ({ default: (await import("./Login")).Login }));

/** Everything around the frame: colours, access, language and texts. */
export function Shell() {
  const [search] = usePageSearch();
  const scheme: Theme = search.theme ?? systemTheme();
  return (
    <MantineProvider theme={mantineTheme} forceColorScheme={scheme}>
      <Gate wanted={search.lang} />
    </MantineProvider>
  );
}

function Gate({ wanted }: { wanted: Language | undefined }) {
  const session = useQuery({
    ...sessionQuery,
    // While somebody types name and password nothing is asked: asking anew would take the form away.
    refetchInterval: ({ state }) => (state.data || wantsLogin(state.error) ? false : RETRY_MS),
  });
  const language = wanted ?? session.data?.locale ?? browserLanguage();
  const texts = useQuery({
    ...textsQuery(language),
    enabled: session.isSuccess,
    placeholderData: (before) => before,
  });
  const t = useMemo(() => translator(texts.data ?? {}, language), [texts.data, language]);
  useEffect(() => {
    document.documentElement.lang = language;
  }, [language]);
  const bench = useBench();
  const connection = bench && `${bench.epoch} ${bench.turbine ?? ""}`;
  useEffect(() => {
    void queryClient.invalidateQueries({ queryKey: turbineQuery.queryKey });
  }, [connection]);
  useEffect(() => {
    if (session.isSuccess) startLive();
  }, [session.isSuccess]);
  useEffect(() => onSignedOut(() => void queryClient.invalidateQueries(sessionQuery)), []);

  if (session.isSuccess && texts.data) {
    return (
      <TextsContext value={t}>
        <Frame />
      </TextsContext>
    );
  }
  const boot = bootTranslator(language);
  if (wantsLogin(session.error)) {
    return (
      <Suspense>
        <Login t={boot} />
      </Suspense>
    );
  }
  if (session.error instanceof Problem && session.error.doc.status === UNAUTHORISED)
    return <NoAccess t={boot} />;
  if (session.error ?? texts.error) return <NoAccess t={boot} unreachable />;
  return (
    <Center h="100%">
      <Loader aria-label={boot("page.boot.loading")} />
    </Center>
  );
}

/** Users are set up, so that nothing but a login opens the page. */
function wantsLogin(error: unknown): boolean {
  return error instanceof Problem && error.doc.code === LOGIN_NEEDED;
}

function browserLanguage(): Language {
  return navigator.language.startsWith("de") ? "de" : "en";
}

function systemTheme(): Theme {
  return matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
}
