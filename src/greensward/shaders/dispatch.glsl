// Number of a workgroup in a dispatch of several rows: drivers allow 65,535 workgroups a side.
uint workgroupIndex() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
