model SingleTankLinear "one first-order lag about an operating point"
  // Units are those of the record.
  parameter Real K = 2 "rise of the level for one unit of the command";
  parameter Real tau(min=0) = 80 "time constant";
  parameter Real offset = 1.5 "level at a command of zero";
  input Real u "command";
  output Real level(start=10);
  Real outflow = level - offset;
equation
  tau*der(level) = K*u - outflow;
end SingleTankLinear;
