// Numbers of the classes of columns and cells that are no periods; 0 stands for no period.

export const WITHOUT_CONTACT = -1;
export const OUTSIDE = -2;
export const ESCAPED = -3;
export const NOT_SETTLED = -4;
