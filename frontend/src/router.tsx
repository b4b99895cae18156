import { createRootRoute, createRoute, createRouter, lazyRouteComponent } from "@tanstack/react-router";
import { Shell } from "./frame/Shell";
import { NotFound } from "./frame/NotFound";
import { parseSearch, readSearch, stringifySearch } from "./frame/search";

const rootRoute = createRootRoute({
  component: Shell,
  notFoundComponent: NotFound,
  validateSearch: readSearch,
});

const overviewRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/",
  component: lazyRouteComponent(() => import("./pages/overview/OverviewPage"), "OverviewPage"),
});

const parametersRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/parameters",
  component: lazyRouteComponent(() => import("./pages/parameters/ParametersPage"), "ParametersPage"),
});

const axisRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/axis",
  component: lazyRouteComponent(() => import("./pages/axis/AxisRoom"), "AxisRoom"),
});

const setsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/sets",
  component: lazyRouteComponent(() => import("./pages/sets/SetsPage"), "SetsPage"),
});

const recordingsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/recordings",
  component: lazyRouteComponent(() => import("./pages/recordings/RecordingsPage"), "RecordingsPage"),
});

const busRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/bus",
  component: lazyRouteComponent(() => import("./pages/bus/BusPage"), "BusPage"),
});

const proceduresRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/procedures",
  component: lazyRouteComponent(() => import("./pages/procedures/ProceduresPage"), "ProceduresPage"),
});

const settingsRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/settings",
  component: lazyRouteComponent(() => import("./pages/settings/SettingsPage"), "SettingsPage"),
});

const instructorRoute = createRoute({
  getParentRoute: () => rootRoute,
  path: "/instructor",
  component: lazyRouteComponent(() => import("./pages/instructor/InstructorPage"), "InstructorPage"),
});

export const router = createRouter({
  routeTree: rootRoute.addChildren([
    overviewRoute,
    axisRoute,
    parametersRoute,
    setsRoute,
    recordingsRoute,
    busRoute,
    proceduresRoute,
    settingsRoute,
    instructorRoute,
  ]),
  parseSearch,
  stringifySearch,
  defaultPreload: "intent",
});

declare module "@tanstack/react-router" {
  interface Register {
    router: typeof router;
  }
}
