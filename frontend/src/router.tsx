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

export const router = createRouter({
  routeTree: rootRoute.addChildren([overviewRoute, parametersRoute]),
  parseSearch,
  stringifySearch,
  defaultPreload: "intent",
});

declare module "@tanstack/react-router" {
  interface Register {
    router: typeof router;
  }
}
