import { createTheme } from "@mantine/core";

const FONT = '"Inter Variable", system-ui, "Segoe UI", Roboto, sans-serif';
/** Large enough for a glove. */
const TARGET_PX = 40;

export const theme = createTheme({
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
    Select: { styles: { input: { minHeight: TARGET_PX } } },
    Modal: { defaultProps: { centered: true, overlayProps: { backgroundOpacity: 0.55 } } },
    Tooltip: { defaultProps: { openDelay: 300, withArrow: true, multiline: true, maw: 340 } },
  },
});
