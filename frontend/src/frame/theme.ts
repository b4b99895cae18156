import { createTheme, type MantineColorsTuple } from "@mantine/core";

const FONT = '"Inter Variable", system-ui, "Segoe UI", Roboto, sans-serif';
/** Large enough for a glove. */
const TARGET_PX = 40;
const TOP = "var(--hs-top)";
const PANEL = "var(--hs-panel)";

/** Greys with the blue of the panels, so that controls belong to the page. */
const DARK: MantineColorsTuple = [
  "#e8edf2",
  "#cdd6df",
  "#a3b0be",
  "#7c8b9a",
  "#475665",
  "#303c49",
  "#202a35",
  "#182029",
  "#10151b",
  "#0b0f14",
];

export const theme = createTheme({
  colors: { dark: DARK },
  fontFamily: FONT,
  headings: { fontFamily: FONT },
  primaryColor: "blue",
  primaryShade: { light: 8, dark: 8 },
  defaultRadius: "sm",
  components: {
    Button: { defaultProps: { h: TARGET_PX } },
    ActionIcon: { defaultProps: { size: TARGET_PX, variant: "default" } },
    CloseButton: { defaultProps: { size: TARGET_PX } },
    TextInput: { styles: { input: { minHeight: TARGET_PX } } },
    PasswordInput: { styles: { input: { minHeight: TARGET_PX }, innerInput: { minHeight: TARGET_PX - 2 } } },
    NumberInput: { styles: { input: { minHeight: TARGET_PX } } },
    Autocomplete: { styles: { input: { minHeight: TARGET_PX } } },
    Select: { styles: { input: { minHeight: TARGET_PX } } },
    Modal: {
      defaultProps: { centered: true, overlayProps: { backgroundOpacity: 0.55 } },
      // Dialogs stay below the top bar: STOP is reachable whatever is open.
      styles: {
        overlay: { top: TOP },
        inner: { top: TOP, height: `calc(100% - ${TOP})` },
        content: { background: PANEL },
        header: { background: PANEL },
      },
    },
    // A name needs a role to be read out.
    Loader: { defaultProps: { role: "status" } },
    Tooltip: { defaultProps: { openDelay: 300, withArrow: true, multiline: true, maw: 340 } },
  },
});
