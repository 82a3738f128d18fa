// A picture as its kernels read it: what the host says, what is worked out on the device, and the transfer function.

const uint TABLE = 1024u; // entries of the transfer function

struct Frame {
    RenderView view;
    RenderPlan plan;
    FLOATS table[TABLE]; // sRGB colour, and opacity of one step
};
